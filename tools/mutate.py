"""Change lines of the package one at a time and see whether the tests notice (CONTRIBUTING says how).

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
from collections.abc import Iterator
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


def replacements(node: ast.AST, text: str) -> Iterator[tuple[int, int, str]]:
    """Yield changes of a node that stands on one line: columns from, to, and what comes there."""

    def operator(left: ast.expr, right: ast.expr, old: str, new: str) -> Iterator:
        between = text[left.end_col_offset : right.col_offset]
        if old in between:
            at = left.end_col_offset + between.index(old)
            yield at, at + len(old), new

    def whole(inner: ast.AST, new: str) -> tuple[int, int, str]:
        return inner.col_offset, inner.end_col_offset, new

    def source(inner: ast.AST) -> str:
        return text[inner.col_offset : inner.end_col_offset]

    match node:
        case ast.Compare(left=left, ops=[op], comparators=[right]):
            for old, new in COMPARISONS[type(op)]:
                yield from operator(left, right, old, new)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATIONS:
            yield from operator(left, right, *OPERATIONS[type(op)])
        case ast.AugAssign(target=left, op=op, value=right) if type(op) in OPERATIONS:
            yield from operator(left, right, *OPERATIONS[type(op)])
        case ast.BoolOp(op=op, values=[left, right, *_]):
            words = ("and", "or") if isinstance(op, ast.And) else ("or", "and")
            yield from operator(left, right, *words)
        case ast.Constant(value=bool() as value):
            yield whole(node, str(not value))
        case ast.Constant(value=int() | float() as value):
            yield whole(node, repr(value + 1))
            yield whole(node, repr(value - 1 if value else -1))
        case ast.Constant(value=str() as value) if value.replace("_", "").isalnum():
            yield whole(node, repr(value + "X"))
        case ast.UnaryOp(op=ast.Not() | ast.USub(), operand=inner):
            yield whole(node, f"({source(inner)})")
        case ast.If(test=test) | ast.IfExp(test=test) | ast.While(test=test):
            if test.end_lineno == test.lineno:
                yield whole(test, f"(not ({source(test)}))")
        case ast.comprehension(ifs=[test, *_]):
            yield whole(test, f"(not ({source(test)}))")
        case ast.Return(value=ast.expr() as value) if value.end_lineno == node.lineno:
            yield whole(node, "return None")
        case ast.Continue():
            yield whole(node, "break")
        case ast.Break():
            yield whole(node, "continue")
        case ast.Expr(value=ast.Call()):
            yield whole(node, "pass")
        case ast.Call(args=args, keywords=keywords) if len(args) + len(keywords) > 1:
            given = sorted([*args, *keywords], key=lambda one: one.col_offset)
            if all(one.lineno == one.end_lineno == node.lineno for one in given):
                yield given[-2].end_col_offset, given[-1].end_col_offset, ""


def _line_of(node: ast.AST) -> int:
    inner = node.test if isinstance(node, ast.If | ast.While) else node
    inner = inner.ifs[0] if isinstance(inner, ast.comprehension) and inner.ifs else inner
    return getattr(inner, "lineno", 0)


def _one_line(node: ast.AST) -> bool:
    if isinstance(node, ast.If | ast.While | ast.comprehension):
        return True
    return getattr(node, "end_lineno", 0) == getattr(node, "lineno", -1)


def _runs(function: ast.AST) -> Iterator[ast.AST]:
    """Yield nodes that are run: neither annotations, nor text within text, nor docstrings."""
    skipped = {
        id(getattr(function, "returns", None)),
        id(getattr(function, "decorator_list", None)),
    }
    stack = [function]
    while stack:
        node = stack.pop()
        yield node
        for name, value in ast.iter_fields(node):
            if name in ("annotation", "returns", "decorator_list") or id(value) in skipped:
                continue
            children = value if isinstance(value, list) else [value]
            stack += [c for c in children if isinstance(c, ast.AST) and not _is_text(c)]


def _is_text(node: ast.AST) -> bool:
    docstring = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    return docstring or isinstance(node, ast.JoinedStr)


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
            if not number or not _one_line(node) or not lines[number - 1].isascii():
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
    """Return where the line stands in a tree, and its number: in its module, else in the function of
    that name elsewhere, else wherever it stands only once. None if it is gone."""
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
    """Return test files in rings: those that import a module (the ones named after it first), then
    those that reach it over one more module, and so on."""
    known = {_dotted(p, root): imports(p) for p in sorted((root / "ajgdata").rglob("*.py"))}
    folders = [root / folder for folder in TESTS]
    helpers = {p.stem: imports(p) for folder in folders for p in folder.rglob("*.py")}
    reached = {}
    for path in sorted(p for folder in folders for p in folder.rglob("test_*.py")):
        names = imports(path)
        reached[path] = names.union(*(helpers[name] for name in names & set(helpers)))
    wanted, rings = {_dotted(root / module, root)}, []
    stem = Path(module).stem
    while reached:
        ring = [path for path, names in reached.items() if names & wanted]
        ring.sort(key=lambda path: (stem not in path.stem, path.stem))
        rings.append([str(path.relative_to(root)) for path in ring])
        reached = {path: names for path, names in reached.items() if path not in ring}
        wider = wanted | {name for name, names in known.items() if names & wanted}
        if wider == wanted:
            break
        wanted = wider
    return [ring for ring in rings if ring]


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
    """Yield each mutant with its outcome: killed, survived, timeout (a limit for each ring of tests)
    or gone."""
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
