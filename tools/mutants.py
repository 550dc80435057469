"""Test the tests: change the package in random places, and count the changes that a test detects.

    python -m tools.mutants --count 40 --seed 0

A mutant is a copy of the package with one small change, e.g. `<` instead of `<=`. A mutant that
fails a test is *killed*; a *survivor* shows behaviour that no test checks, or a change without any
effect. The lines are drawn uniformly from all lines of `ajgdata/` that allow a change.

First, the complete suite runs under coverage and records the lines that each test executes
(half an hour). Then each mutant runs only the tests that execute its line (a minute or two). The
tests run in a clone of the last commit, so the working tree can be edited meanwhile. `--folder`
keeps the clone and the record: a second call with other mutants starts at once.

Needs `pip install coverage`. `tools/mutants_plugin.py` runs inside pytest.
"""

from __future__ import annotations

import argparse
import ast
import copy
import itertools
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ajgdata.evaluate.agreement import wilson_interval

ROOT = Path(__file__).resolve().parents[1]
#: Longest time of the tests for one mutant in seconds, by their times under coverage.
BUDGET_S = 120

#: Operator that replaces another operator.
SWAPS: dict[type, type] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.And: ast.Or,
    ast.Or: ast.And,
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
}
#: Fields of type annotations, which are not executed.
NOT_EXECUTED = ("annotation", "returns")
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)


@dataclass(frozen=True)
class Mutant:
    """One change of one module: `new` replaces `old` in a field of the node `parent`."""

    file: str
    line: int
    statement: int  # first line of the statement around the change
    at_import: bool  # outside of all functions
    tree: ast.Module
    parent: ast.AST
    field: str
    index: int | None  # position in the field if the field is a list
    old: ast.AST
    new: ast.AST

    def source(self) -> str:
        """Return the changed module."""
        self._put(self.new)
        text = ast.unparse(ast.fix_missing_locations(self.tree))
        self._put(self.old)
        return text

    def _put(self, node: ast.AST) -> None:
        """Set the place of the change to a node."""
        if self.index is None:
            setattr(self.parent, self.field, node)
        else:
            getattr(self.parent, self.field)[self.index] = node

    def __str__(self) -> str:
        before = shorten(ast.unparse(self.old))
        after = shorten(ast.unparse(self.new))
        return f"{self.file}:{self.line}: {before}  ->  {after}"


def shorten(code: str, length: int = 150) -> str:
    """Return code in one line of limited length."""
    line = " ".join(code.split())
    return line if len(line) <= length else line[: length - 1] + "…"


def changed(node: ast.AST, **fields: Any) -> Any:
    """Return a copy of a node with other fields."""
    new = copy.copy(node)
    for name, value in fields.items():
        setattr(new, name, value)
    return new


def changes(node: ast.AST) -> Iterator[tuple[int, ast.AST]]:
    """Yield the line and the replacement of each possible change of a node."""
    match node:
        case ast.Call(keywords=keywords):
            for dropped in keywords:
                kept = [keyword for keyword in keywords if keyword is not dropped]
                yield dropped.value.lineno, changed(node, keywords=kept)
        case ast.Constant(value=value, lineno=line):
            if isinstance(value, bool):
                yield line, ast.Constant(not value)
            elif isinstance(value, int | float):
                yield line, ast.Constant(value + 1)
            elif isinstance(value, str):
                yield line, ast.Constant(value + "x")
        case ast.expr(lineno=line):
            yield from ((line, new) for new in changed_operator(node))
        case ast.stmt(lineno=line):
            yield from ((line, new) for new in changed_statement(node))


def changed_operator(node: ast.AST) -> Iterator[ast.AST]:
    """Yield an expression with another operator, or without the operator."""
    match node:
        case ast.Compare(ops=[first, *more]):
            yield changed(node, ops=[SWAPS[type(first)](), *more])
        case ast.BinOp(op=operator) | ast.BoolOp(op=operator) if type(operator) in SWAPS:
            yield changed(node, op=SWAPS[type(operator)]())
        case ast.UnaryOp(op=ast.Not() | ast.USub(), operand=operand):
            yield operand


def changed_statement(node: ast.AST) -> Iterator[ast.AST]:
    """Yield an empty statement, or one with another operator or value."""
    match node:
        case ast.AugAssign(op=operator) if type(operator) in SWAPS:
            yield changed(node, op=SWAPS[type(operator)]())
        case ast.Return(value=value) if value and ast.unparse(value) != "None":
            yield ast.Return(ast.Constant(None))
        case ast.Expr(value=ast.Call()) | ast.Raise():
            yield ast.Pass()
        case ast.Assign(targets=[ast.Attribute() | ast.Subscript()]):
            yield ast.Pass()


def is_text(node: ast.AST) -> bool:
    """Return whether a node is a docstring or a text after an attribute."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def mutants(path: Path, root: Path) -> Iterator[Mutant]:
    """Yield all mutants of a module."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    file = str(path.relative_to(root))

    def below(parent: ast.AST, statement: int, at_import: bool) -> Iterator[Mutant]:
        for field, value in ast.iter_fields(parent):
            if field in NOT_EXECUTED:
                continue
            outside = at_import and not (field == "body" and isinstance(parent, FUNCTIONS))
            children = enumerate(value) if isinstance(value, list) else [(None, value)]
            for index, child in children:
                if not isinstance(child, ast.AST) or is_text(child):
                    continue
                is_statement = isinstance(child, ast.stmt)
                first_line = child.lineno if is_statement else statement
                replacements = list(changes(child))
                if field in ("test", "ifs"):
                    replacements.append((child.lineno, ast.UnaryOp(ast.Not(), child)))
                for line, new in replacements:
                    yield Mutant(
                        file=file,
                        line=line,
                        statement=first_line,
                        at_import=outside,
                        tree=tree,
                        parent=parent,
                        field=field,
                        index=index,
                        old=child,
                        new=new,
                    )
                yield from below(child, first_line, outside)

    yield from below(tree, 1, at_import=True)


def draw(root: Path, count: int, seed: int) -> list[Mutant]:
    """Draw mutants: first a line of the package, then a change on this line.

    With the same seed, a larger number of mutants extends a smaller one.
    """
    by_line: dict[tuple[str, int], list[Mutant]] = {}
    for path in sorted((root / "ajgdata").rglob("*.py")):
        for mutant in mutants(path, root):
            by_line.setdefault((mutant.file, mutant.line), []).append(mutant)
    generator = random.Random(seed)
    lines = sorted(by_line)
    generator.shuffle(lines)
    return [generator.choice(by_line[line]) for line in lines[:count]]


def run_pytest(folder: Path, arguments: list[str], limit_s: float | None, **more: str) -> str:
    """Run pytest in the clone; returns an empty text, or the reason of the failure."""
    places = [str(folder), str(folder / "clone"), os.environ.get("PYTHONPATH", "")]
    command = [sys.executable, "-m", "pytest", "-p", "mutants_plugin", "-n", "0", *arguments]
    with (folder / "pytest.log").open("w+") as log:
        process = subprocess.Popen(
            command,
            cwd=folder / "clone",
            env=os.environ | {"PYTHONPATH": os.pathsep.join(places)} | more,
            stdout=log,
            stderr=log,
            start_new_session=True,
        )
        try:
            code = process.wait(limit_s)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            return "time limit"
        log.seek(0)
        failures = [line.split()[1] for line in log if line.startswith(("FAILED", "ERROR "))]
    if code == 0:
        return ""
    return failures[0] if failures else f"exit code {code}"


def prepare(folder: Path, commit: str) -> None:
    """Clone the repository, run its suite under coverage, and record the lines of each test."""
    import coverage

    if (folder / "tests.json").exists():  # an interrupted call can leave a mutant
        subprocess.run(["git", "checkout", "--quiet", "."], cwd=folder / "clone", check=True)
        return
    folder.mkdir(parents=True, exist_ok=True)
    subprocess.run(["git", "clone", "--quiet", ROOT, folder / "clone"], check=True)
    subprocess.run(["git", "checkout", "--quiet", commit], cwd=folder / "clone", check=True)
    shutil.copy(ROOT / "tools/mutants_plugin.py", folder)
    startup = "import coverage\ncoverage.process_startup()\n"
    (folder / "sitecustomize.py").write_text(startup, encoding="utf-8")
    settings = folder / "coveragerc"
    settings.write_text(
        f"[run]\nsource = {folder}/clone/ajgdata\ndata_file = {folder}/coverage\n"
        "parallel = true\nconcurrency = thread,multiprocessing\ncontext = ${MUTANTS_TEST-}\n",
        encoding="utf-8",
    )
    print("running the suite under coverage", flush=True)
    record = str(folder / "tests.part")
    run_pytest(folder, [], None, COVERAGE_PROCESS_START=str(settings), MUTANTS_RECORD=record)
    measured = coverage.Coverage(data_file=str(folder / "coverage"), config_file=str(settings))
    measured.combine()
    measured.save()
    (folder / "tests.part").rename(folder / "tests.json")


class Selection:
    """The choice of tests for a mutant, from the record of the suite."""

    def __init__(self, folder: Path) -> None:
        import coverage

        self.folder = folder
        self.data = coverage.CoverageData(str(folder / "coverage"))
        self.data.read()
        tests = json.loads((folder / "tests.json").read_text(encoding="utf-8"))
        self.tests = {test["context"]: test for test in tests if test["passed"]}

    def tests_for(self, mutant: Mutant) -> list[dict[str, Any]]:
        """Return the tests that execute a line, the fastest first, up to the budget of time.

        Every test can depend on a line that runs at import, or in a fixture that tests share. For
        such a line, other tests follow, with a budget of their own. The first tests of a line that
        runs at import are those that execute functions of the same file.
        """
        lines = self.data.contexts_by_lineno(str(self.folder / "clone" / mutant.file))
        contexts = set(lines.get(mutant.line) or lines.get(mutant.statement) or [])
        if mutant.at_import:
            contexts = {name for names in lines.values() if "" not in names for name in names}
            contexts.add("")
        first = contexts & self.tests.keys()
        names = self._fastest(first)
        if "" in contexts or not first:
            names += self._fastest(self.tests.keys() - first)
        files = list(dict.fromkeys(self.tests[name]["file"] for name in names))
        return sorted((self.tests[name] for name in names), key=lambda t: files.index(t["file"]))

    def _fastest(self, names: set[str]) -> list[str]:
        """Return the fastest of some tests, up to the budget of time, but at least one."""
        ordered = sorted(names, key=lambda name: (self.tests[name]["seconds"], name))
        totals = itertools.accumulate(self.tests[name]["seconds"] for name in ordered)
        count = sum(total_s <= BUDGET_S for total_s in totals)
        return ordered[: max(count, 1)]


def killer(folder: Path, mutant: Mutant, tests: list[dict[str, Any]]) -> str:
    """Return the test that fails on a mutant, or an empty text.

    Each folder of tests has its own run, because their `conftest.py` files have one name.
    """
    path = folder / "clone" / mutant.file
    original = path.read_bytes()
    selected = folder / "selected.json"
    selected.write_text(json.dumps([test["test"] for test in tests]), encoding="utf-8")
    by_folder: dict[Path, list[dict[str, Any]]] = {}
    for test in tests:
        by_folder.setdefault(Path(test["file"]).parent, []).append(test)
    try:
        path.write_text(mutant.source(), encoding="utf-8")
        for members in by_folder.values():
            limit_s = 120 + 4 * sum(test["seconds"] for test in members)
            files = list(dict.fromkeys(test["file"] for test in members))
            name = run_pytest(folder, ["-x", *files], limit_s, MUTANTS_SELECTED=str(selected))
            if name:
                return name
        return ""
    finally:
        path.write_bytes(original)


def measure(folder: Path, commit: str, count: int, seed: int) -> None:
    """Print the result of each mutant, and the share of killed mutants."""
    prepare(folder, commit)
    selection = Selection(folder)
    killed = 0
    for number, mutant in enumerate(draw(folder / "clone", count, seed), start=1):
        tests = selection.tests_for(mutant)
        name = killer(folder, mutant, tests)
        killed += bool(name)
        result = f"killed by {name}" if name else f"SURVIVED {len(tests)} tests"
        print(f"{number:3} {mutant}\n    {result}", flush=True)
    low, high = wilson_interval(killed / count, count)
    print(f"killed {killed} of {count}: {killed / count:.0%} ({low:.0%} to {high:.0%})")


def main() -> None:
    """Read the options and measure."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=40, help="number of mutants")
    parser.add_argument("--seed", type=int, default=0, help="seed of the random draw")
    parser.add_argument("--commit", default="HEAD", help="commit to test")
    parser.add_argument("--folder", type=Path, help="folder for the clone and the record")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = (options.folder or Path(temporary) / "mutants").resolve()
        measure(folder, options.commit, options.count, options.seed)


if __name__ == "__main__":
    main()
