"""Change lines of the package one at a time and see whether the tests notice: see CONTRIBUTING.

`draw` picks lines at random and one change for each, `score` tries each change in a copy of the
project: the share that some test fails on is the mutation score. A change is kept as text (module,
function, line before and after), so that a later tree can be scored on the same ones.
"""

import argparse
import ast
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from types import CodeType

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("features", "store", "evaluate", "gripper", "models")
#: Tests that start no workflow; `docs` and `workflow` would take minutes a line.
TESTS = ("tests/unit", "tests/contract", "tests/verification")
COPIED = ("ajgdata", "tests", "tools", "benchmarks", "docs", "datasets", "workflow", "reports",
          "config", "profiles")  # fmt: skip
COMPARISONS: dict[type[ast.cmpop], tuple[tuple[str, str], ...]] = {
    ast.Lt: (("<", "<="), ("<", ">")),
    ast.LtE: (("<=", "<"), ("<=", ">")),
    ast.Gt: ((">", ">="), (">", "<")),
    ast.GtE: ((">=", ">"), (">=", "<")),
    ast.Eq: (("==", "!="),),
    ast.NotEq: (("!=", "=="),),
    ast.Is: (("is", "is not"),),
    ast.IsNot: (("is not", "is"),),
    ast.In: (("in", "not in"),),
    ast.NotIn: (("not in", "in"),),
}
OPERATIONS: dict[type[ast.operator], tuple[str, str]] = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.FloorDiv: ("//", "*"),
    ast.Mod: ("%", "*"),
    ast.Pow: ("**", "*"),
    ast.BitAnd: ("&", "|"),
    ast.BitOr: ("|", "&"),
}


@dataclass(frozen=True)
class Mutant:
    """One changed line. `occurrence` counts equal lines of the same function."""

    module: str
    function: str
    line: str
    changed: str
    occurrence: int = 0


def functions(tree: ast.Module) -> Iterator[tuple[str, ast.AST]]:
    """Yield functions and methods by dotted name, the outermost only."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            yield node.name, node
        elif isinstance(node, ast.ClassDef):
            for inner in node.body:
                if isinstance(inner, ast.FunctionDef):
                    yield f"{node.name}.{inner.name}", inner


#: Columns from and to, and what comes there.
Replacement = tuple[int, int, str]


def replacements(node: ast.AST, text: str) -> Iterator[Replacement]:
    """Yield changes of a node that stands on one line."""
    yield from _operators(node, text)
    yield from _constants(node)
    yield from _conditions(node, text)
    yield from _statements(node)


def _operators(node: ast.AST, text: str) -> Iterator[Replacement]:
    changes: Iterable[tuple[str, str]] = ()
    match node:
        case ast.Compare(left=left, ops=[op], comparators=[right]):
            changes = COMPARISONS[type(op)]
        case (
            ast.BinOp(left=left, op=op, right=right)
            | ast.AugAssign(target=left, op=op, value=right)
        ) if type(op) in OPERATIONS:
            changes = [OPERATIONS[type(op)]]
        case ast.BoolOp(op=op, values=[left, right, *_]):
            changes = [("and", "or") if isinstance(op, ast.And) else ("or", "and")]
    for old, new in changes:
        at = text.find(old, left.end_col_offset, right.col_offset)
        if at >= 0:
            yield at, at + len(old), new


def _constants(node: ast.AST) -> Iterator[Replacement]:
    match node:
        case ast.Constant(value=bool() as value):
            yield _whole(node, str(not value))
        case ast.Constant(value=int() | float() as value):
            yield _whole(node, repr(value + 1))
            yield _whole(node, repr(value - 1 if value else -1))
        case ast.Constant(value=str() as value) if value.replace("_", "").isalnum():
            yield _whole(node, repr(value + "X"))


def _conditions(node: ast.AST, text: str) -> Iterator[Replacement]:
    match node:
        case ast.UnaryOp(op=ast.Not() | ast.USub(), operand=inner):
            yield _whole(node, f"({text[inner.col_offset : inner.end_col_offset]})")
        case (
            ast.If(test=test)
            | ast.IfExp(test=test)
            | ast.While(test=test)
            | ast.comprehension(ifs=[test, *_])
        ) if test.end_lineno == test.lineno:
            yield _whole(test, f"(not ({text[test.col_offset : test.end_col_offset]}))")


def _statements(node: ast.AST) -> Iterator[Replacement]:
    match node:
        case ast.Return(value=ast.expr()):
            yield _whole(node, "return None")
        case ast.Continue():
            yield _whole(node, "break")
        case ast.Break():
            yield _whole(node, "continue")
        case ast.Expr(value=ast.Call()):
            yield _whole(node, "pass")
        case ast.Call(args=args, keywords=keywords) if len(args) + len(keywords) > 1:
            *_, before, last = sorted([*args, *keywords], key=lambda given: given.col_offset)
            yield before.end_col_offset, last.end_col_offset, ""


def _whole(node: ast.AST, new: str) -> Replacement:
    return node.col_offset, node.end_col_offset, new


def _line_of(node: ast.AST) -> int | None:
    """Return the line that a node, or its condition, stands on whole."""
    match node:
        case ast.If(test=inner) | ast.While(test=inner) | ast.comprehension(ifs=[inner, *_]):
            node = inner
    first = getattr(node, "lineno", None)
    return first if first == getattr(node, "end_lineno", None) else None


def _runs(node: ast.AST) -> Iterator[ast.AST]:
    """Yield nodes that are run: neither annotations, nor docstrings, nor text with values in it."""
    yield node
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list"):
            continue
        for child in value if isinstance(value, list) else [value]:
            docstring = isinstance(child, ast.Expr) and isinstance(child.value, ast.Constant)
            if (
                isinstance(child, ast.AST)
                and not docstring
                and not isinstance(child, ast.JoinedStr)
            ):
                yield from _runs(child)


def mutants_of(module: Path, root: Path) -> dict[int, list[Mutant]]:
    """Return every change that makes other bytecode, by line number."""
    text = (root / module).read_text(encoding="utf-8")
    lines = text.splitlines()
    original = bytecode(text)
    made: dict[int, list[Mutant]] = {}
    for name, function in functions(ast.parse(text)):
        body = [line.strip() for line in lines[function.lineno - 1 : function.end_lineno]]
        for node in _runs(function):
            number = _line_of(node)
            if number is None or not lines[number - 1].isascii():
                continue  # columns are counted in bytes
            line = lines[number - 1]
            for start, end, new in replacements(node, line):
                changed = line[:start] + new + line[end:]
                other = "\n".join([*lines[: number - 1], changed, *lines[number:]])
                if (code := bytecode(other)) and code != original:
                    before = body[: number - function.lineno].count(line.strip())
                    one = Mutant(str(module), name, line.strip(), changed.strip(), before)
                    made.setdefault(number, []).append(one)
    return made


def bytecode(text: str) -> object:
    """Return what the interpreter would run, without line numbers; None for what is no Python."""

    def content(code: CodeType) -> tuple:
        inner = (content(c) if isinstance(c, CodeType) else (type(c), c) for c in code.co_consts)
        return code.co_code, code.co_names, code.co_varnames, *inner

    try:
        return repr(content(compile(text, "-", "exec", dont_inherit=True)))
    except SyntaxError:
        return None


def draw(root: Path, packages: list[str], count: int, seed: int) -> list[Mutant]:
    """Return one change each of `count` lines, drawn without replacement."""
    files = sorted(p for name in packages for p in (root / "ajgdata" / name).rglob("*.py"))
    lines = [
        (made, number)
        for path in files
        for made in [mutants_of(path.relative_to(root), root)]
        for number in sorted(made)
    ]
    chance = random.Random(seed)
    return [chance.choice(made[number]) for made, number in chance.sample(lines, count)]


def find(mutant: Mutant, root: Path) -> tuple[Path, int] | None:
    """Return the module that has the line now, and its number: in the same module, else in the
    function of that name elsewhere, else where it stands only once. None if it is gone."""
    places = []
    for path in sorted((root / "ajgdata").rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        lines = [line.strip() for line in text.splitlines()]
        if mutant.line not in lines:
            continue
        for name, function in functions(ast.parse(text)):
            numbers = range(function.lineno, function.end_lineno + 1)
            found = [n for n in numbers if lines[n - 1] == mutant.line]
            if found:
                at = found[min(mutant.occurrence, len(found) - 1)]
                own = str(path.relative_to(root)) == mutant.module
                same = name.rpartition(".")[2] == mutant.function.rpartition(".")[2]
                places.append((2 * same + own, path, at))
    best = sorted(places, key=lambda place: -place[0])
    if not best or (best[0][0] < 2 and len(best) > 1):
        return None
    return best[0][1:]


def imports(path: Path) -> set[str]:
    """Return dotted names of ours that a module imports, at any depth."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
    return names


def concerned(module: str, root: Path) -> list[list[str]]:
    """Return test files in rings: those named after a module, those that import it, those reaching
    it over one more module, and so on."""
    known = {_dotted(p, root): imports(p) for p in sorted((root / "ajgdata").rglob("*.py"))}
    folders = [root / folder for folder in TESTS]
    helpers = {p.stem: imports(p) for folder in folders for p in folder.rglob("*.py")}
    reached = {}
    for path in sorted(p for folder in folders for p in folder.rglob("test_*.py")):
        names = imports(path)
        reached[path] = names.union(*(helpers[name] for name in names & set(helpers)))
    wanted = {_dotted(root / module, root)}
    rings = [[path for path in reached if path.stem.endswith(f"_{Path(module).stem}")]]
    while True:
        done = {path for ring in rings for path in ring}
        rings.append([p for p, names in reached.items() if names & wanted and p not in done])
        wider = wanted | {name for name, names in known.items() if names & wanted}
        if wider == wanted:
            return [[str(path.relative_to(root)) for path in ring] for ring in rings if ring]
        wanted = wider


def _dotted(path: Path, root: Path) -> str:
    parts = path.relative_to(root).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def copy_of(root: Path, folder: Path) -> Path:
    """Return a copy of the project without results, that may be changed."""
    ignored = shutil.ignore_patterns("__pycache__", "*.nbi", "*.nbc")
    for name in COPIED:
        if (root / name).is_dir():
            shutil.copytree(root / name, folder / name, ignore=ignored)
    for path in root.iterdir():
        if path.is_file():
            shutil.copy2(path, folder / path.name)
    return folder


def tried(tests: list[str], root: Path, seconds: int) -> str:
    """Return what the tests say of a tree: killed, survived or timeout."""
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-n", "0", "-p", "no:cacheprovider"]
    environment = os.environ | {"PYTHONPATH": str(root)}
    done = subprocess.run(
        [*command, *tests], cwd=root, env=environment, check=False, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 5)),
    )  # fmt: skip
    if done.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        return "timeout"
    if done.returncode not in (0, 1, 2, 5):
        raise SystemExit(f"pytest ended with {done.returncode}:\n{done.stdout}")
    return "killed" if done.returncode in (1, 2) else "survived"


def score(mutants: list[Mutant], root: Path, rings: int, seconds: int) -> Iterator[dict]:
    """Yield each mutant with its outcome: killed, survived, gone, or timeout (for each ring)."""
    with tempfile.TemporaryDirectory() as temporary:
        tree = copy_of(root, Path(temporary))
        for index, mutant in enumerate(mutants):
            begun, outcome = time.monotonic(), "gone"
            if place := find(mutant, tree):
                path, number = place
                kept = path.read_text(encoding="utf-8")
                lines = kept.splitlines(keepends=True)
                lines[number - 1] = lines[number - 1].replace(mutant.line, mutant.changed)
                path.write_text("".join(lines), encoding="utf-8")
                os.utime(path, (0, 10**9 + index))  # else bytecode kept for the last one is used
                for tests in concerned(str(path.relative_to(tree)), tree)[:rings]:
                    outcome = tried(tests, tree, seconds)
                    if outcome != "survived":
                        break
                path.write_text(kept, encoding="utf-8")
                os.utime(path, (0, 10**9 - 1))
            yield asdict(mutant) | {
                "outcome": outcome,
                "seconds": round(time.monotonic() - begun, 1),
            }


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    drawing = commands.add_parser("draw", help="pick lines and changes")
    drawing.add_argument("--seed", type=int, required=True)
    drawing.add_argument("--count", type=int, default=40)
    drawing.add_argument("--packages", nargs="+", default=PACKAGES)
    scoring = commands.add_parser("score", help="try the changes of a file that `draw` wrote")
    scoring.add_argument("--rings", type=int, default=2, help="how far tests may be, in imports")
    scoring.add_argument("--seconds", type=int, default=120, help="of CPU for a ring")
    for one in (drawing, scoring):
        one.add_argument("file", type=Path, help="JSON with the changes, and their outcomes")
        one.add_argument("--root", type=Path, default=ROOT)
    scoring.add_argument("output", type=Path, help="to score again, without those killed here")
    given = parser.parse_args()
    if given.command == "draw":
        made = draw(given.root, list(given.packages), given.count, given.seed)
        given.file.write_text(json.dumps([asdict(one) for one in made], indent=1) + "\n")
        return
    fields = Mutant.__dataclass_fields__
    known = json.loads(given.file.read_text())
    done = [one for one in known if one.get("outcome") == "killed"]
    mutants = [Mutant(**{key: one[key] for key in fields}) for one in known if one not in done]
    for one in score(mutants, given.root, given.rings, given.seconds):
        done.append(one)
        print(f"{one['outcome']:9}{one['module']} {one['function']} ({one['seconds']:.0f} s)")
        if one["outcome"] != "killed":
            print(f"    - {one['line']}\n    + {one['changed']}")
        sys.stdout.flush()
    given.output.write_text(json.dumps(done, indent=1) + "\n")
    print(dict(Counter(one["outcome"] for one in done)))


if __name__ == "__main__":
    main()
