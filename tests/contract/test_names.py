"""Names of variables, functions, arguments and classes are neither pronouns nor participles."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
AVOIDED = {
    *("told", "asked", "found", "made", "noted", "parted", "surveyed", "heard"),
    *("one", "others", "beside"),
}
#: Not in the package either.
AVOIDED_IN_PACKAGE = AVOIDED | {"given", "kept", "wanted", "rest", "most", "more"}
PACKAGE = ROOT / "ajgdata"
FOLDERS = (PACKAGE, *(ROOT / name for name in ("tests", "tools", "benchmarks", "docs")))
FILES = sorted(file for folder in FOLDERS for file in folder.rglob("*.py"))


def names(source: str) -> Iterator[tuple[int, str]]:
    """Line and name of each variable, function, argument and class."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Name):
            yield node.lineno, node.id
        elif isinstance(node, ast.arg):
            yield node.lineno, node.arg
        elif isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            yield node.lineno, node.name


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(ROOT)))
def test_names_are_nouns(file):
    avoided = AVOIDED_IN_PACKAGE if file.is_relative_to(PACKAGE) else AVOIDED
    poor = [
        f"{file}:{line}: {name}"
        for line, name in names(file.read_text(encoding="utf-8"))
        if name.strip("_").lower() in avoided
    ]
    assert not poor
