"""README, documentation, templates and docstrings are short and use the words of the glossary."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
GENERATED = {"command-line.md", "configuration.md"}
DOCS = sorted(path for path in (ROOT / "docs").glob("*.md") if path.name not in GENERATED)
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *DOCS]
TEXTS = [*PAGES, ROOT / "CHANGELOG.md"]
TEXTS += [path for path in (ROOT / "reports").rglob("*") if path.suffix in {".j2", ".md"}]
#: Words and constructions with a plain alternative.
AVOID = re.compile(
    r"(?<![\w\"`-])(told|parted|anew|mend(s|ed)?|errs|flatters|whoever|shall|seldom|hence|beside"
    r"|hangs on|goes on|never met|not met|held against|of nothing|of ours|of these|of those"
    r"|for others|once more|be it|(?-i:is none)|as it stands|by itself|by themselves|put down"
    r"|handed on|brought (in|into|from)|at most[,.;)]|, too[,.;)])(?![\w\"`-])",
    re.IGNORECASE,
)


def without_code(path: Path) -> str:
    """Return a text without code blocks and comments."""
    text = path.read_text(encoding="utf-8")
    return re.sub(r"^```.*?^```|<!--.*?-->", "", text, flags=re.S | re.M)


def prose(path: Path) -> str:
    """Return a page without code blocks, comments and tables."""
    return re.sub(r"^\|.*$", "", without_code(path), flags=re.M)


def sentence_lengths(text: str) -> list[int]:
    """Return the numbers of words of the sentences; headings and list items end a sentence."""
    blocks = re.split(r"\n\s*\n|\n(?=\s*(?:[-*] |\d+\. |#))", text)
    sentences = [s for block in blocks for s in re.split(r"(?<=[.!?])\s+", block)]
    return [len(s.split()) for s in sentences if len(s.split()) > 3]


def documented(path: Path) -> str:
    """Return the docstrings, help texts and descriptions of fields of a module."""
    texts = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            texts.append(ast.get_docstring(node) or "")
        elif isinstance(node, ast.keyword) and node.arg in {"help", "description"}:
            texts.append(str(getattr(node.value, "value", "")))
    return "\n".join(texts)


def test_the_readme_can_be_read_in_three_minutes():
    assert len((ROOT / "README.md").read_text(encoding="utf-8").split()) <= 700


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_sentences_are_short(path):
    lengths = sentence_lengths(prose(path))
    assert max(lengths, default=0) <= 35
    assert sum(lengths) <= 20 * len(lengths)


def test_pages_and_templates_use_plain_words():
    hits = [(path.name, m.group()) for path in TEXTS for m in AVOID.finditer(without_code(path))]
    assert hits == []


def test_docstrings_and_help_texts_use_plain_words():
    modules = sorted((ROOT / "ajgdata").rglob("*.py"))
    hits = [(path.name, m.group()) for path in modules for m in AVOID.finditer(documented(path))]
    assert hits == []
