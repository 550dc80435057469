"""Measure the structure of the package: figures to report before and after a change, never targets.

    python -m tools.measure_code            figures of the sources
    python -m tools.measure_code --trace    also the files that one recording passes (a minute)

`--trace` runs the workflow on a small data set of noisy tones. In each job, it records the files of
the package whose functions are called between the recording and `metrics.csv`.
"""

from __future__ import annotations

import argparse
import ast
import functools
import json
import os
import subprocess
import sys
import tempfile
import tokenize
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import yaml
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "ajgdata"
#: Functions of the jobs between a recording and `metrics.csv`.
STEPS = ("build_feature_file", "run_experiment", "collect")
#: Name that the settings of each experiment have.
SHARED_BY_DESIGN = "Settings"
# The small data set.
RECORDINGS = 12
SECONDS = 0.2  #: length of a recording
RATE_HZ = 44_100


@functools.cache
def modules() -> dict[str, ast.Module]:
    """Return the syntax tree of each module of the package by its dotted name."""
    trees = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        trees[name] = ast.parse(path.read_text(encoding="utf-8"))
    return trees


def run_time_nodes(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes of a tree without those below `if TYPE_CHECKING`."""
    for node in ast.iter_child_nodes(tree):
        is_typing = isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
        if not is_typing:
            yield node
            yield from run_time_nodes(node)


def imported_names(tree: ast.AST) -> Iterator[str]:
    """Yield the dotted names of modules, and of what is imported from modules, at any depth."""
    for node in run_time_nodes(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def import_circles(trees: dict[str, ast.Module]) -> list[list[str]]:
    """Return groups of modules that import each other, at the top or inside functions.

    A package and the modules inside it are one group only if they import each other by name.
    """
    names = sorted(trees)
    at = {name: number for number, name in enumerate(names)}
    graph = np.zeros((len(names), len(names)), bool)
    for name, tree in trees.items():
        for target in imported_names(tree):
            if target in at and target != name:
                graph[at[name], at[target]] = True
    _, labels = connected_components(csr_array(graph), connection="strong")
    groups = [[names[i] for i in np.flatnonzero(labels == label)] for label in np.unique(labels)]
    return [group for group in groups if len(group) > 1]


def shared_class_names(trees: dict[str, ast.Module]) -> list[str]:
    """Return the names of two or more classes, except `SHARED_BY_DESIGN`."""
    nodes = (node for tree in trees.values() for node in ast.walk(tree))
    names = Counter(node.name for node in nodes if isinstance(node, ast.ClassDef))
    return sorted(name for name, count in names.items() if count > 1 and name != SHARED_BY_DESIGN)


def is_record(node: ast.ClassDef) -> bool:
    """Return whether a class is a dataclass or a named tuple."""
    decorators = [ast.unparse(decorator) for decorator in node.decorator_list]
    bases = [ast.unparse(base) for base in node.bases]
    return "NamedTuple" in bases or any(text.startswith("dataclass") for text in decorators)


def code_lines(path: Path) -> int:
    """Return the number of lines with code; comments, docstrings and empty lines do not count."""
    ignored = {
        tokenize.COMMENT,
        tokenize.NL,
        tokenize.NEWLINE,
        tokenize.INDENT,
        tokenize.DEDENT,
        tokenize.ENCODING,
        tokenize.ENDMARKER,
    }
    with path.open("rb") as stream:
        tokens = [
            token for token in tokenize.tokenize(stream.readline) if token.type not in ignored
        ]
    lines = {line for token in tokens for line in range(token.start[0], token.end[0] + 1)}
    return len(lines - docstring_lines(ast.parse(path.read_text(encoding="utf-8"))))


def docstring_lines(tree: ast.Module) -> set[int]:
    """Return the lines of docstrings."""
    lines: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)):
            first = node.body[0] if node.body else None
            if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
                lines |= set(range(first.lineno, (first.end_lineno or first.lineno) + 1))
    return lines


def function_imports(tree: ast.Module) -> int:
    """Return the number of imports inside functions."""
    functions = (
        node for node in ast.walk(tree) if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))
    )
    imports = {
        inner
        for function in functions
        for inner in ast.walk(function)
        if isinstance(inner, (ast.Import, ast.ImportFrom))
    }
    return len(imports)


def is_tuple_assignment(node: ast.AST) -> bool:
    """Return whether a statement assigns several values to several names, e.g. `a, b = 1, 2`."""
    is_assignment = isinstance(node, ast.Assign) and isinstance(node.value, ast.Tuple)
    return is_assignment and isinstance(node.targets[0], ast.Tuple)


def source_figures() -> dict[str, object]:
    """Return the figures of the sources by name."""
    trees = modules()
    files = sorted(PACKAGE.rglob("*.py"))
    texts = [path.read_text(encoding="utf-8") for path in files]
    nodes = [node for tree in trees.values() for node in ast.walk(tree)]
    classes = [node for node in nodes if isinstance(node, ast.ClassDef)]
    shared = shared_class_names(trees)
    lines = sum(map(code_lines, files))
    nested = [function_imports(tree) for tree in trees.values()]
    tuples = sum(map(is_tuple_assignment, nodes))
    circles = import_circles(trees)
    return {
        "modules": len(files),
        "lines of code": lines,
        "syntax nodes per line of code": round(len(nodes) / lines, 2),
        "record types": sum(map(is_record, classes)),
        "classes with a shared name": f"{len(shared)}: {', '.join(shared)}",
        "import circles": f"{len(circles)}: {'; '.join(' '.join(group) for group in circles)}",
        "tuple assignments per 1,000 lines": round(1000 * tuples / lines, 1),
        "assignment expressions": sum(isinstance(node, ast.NamedExpr) for node in nodes),
        "`# fmt: skip`": sum(text.count("# fmt: skip") for text in texts),
        "imports inside functions": f"{sum(nested)} in {sum(map(bool, nested))} modules",
    }


#: Runs at the start of each Python process of the traced workflow.
TRACER = """
import atexit, json, os, sys, threading
STEPS, FOLDER, PACKAGE = set({steps!r}), {folder!r}, {package!r}
files = {{}}
active = []  # name of the step that is called, and the depth of imports at its call
imports = threading.local()  # what an import executes is no call of the step
def profile(frame, event, argument):
    code, depth = frame.f_code, getattr(imports, "depth", 0)
    if code.co_name == "<module>":
        depth = max(depth + (event == "call") - (event == "return"), 0)
        imports.depth = depth
    if not code.co_filename.startswith(PACKAGE):
        return
    is_step = code.co_name in STEPS
    if event == "call":
        if is_step:
            active.append((code.co_name, depth))
        is_worker = threading.current_thread() is not threading.main_thread()
        if active and (is_worker or depth == active[0][1]):
            files.setdefault(active[0][0], set()).add(code.co_filename)
    elif event == "return" and is_step:
        active.pop()
def write():
    if files:
        with open(os.path.join(FOLDER, f"{{os.getpid()}}.json"), "w") as stream:
            json.dump({{step: sorted(names) for step, names in files.items()}}, stream)
atexit.register(write)
threading.setprofile(profile)
sys.setprofile(profile)
"""


def traced_files() -> dict[str, list[str]]:
    """Return the files of the package that a recording passes, by step.

    Runs the workflow on a small data set.
    """
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        notes = folder / "notes"
        notes.mkdir()
        project = folder / "project"
        write_project(project)
        package = str(PACKAGE) + os.sep
        tracer = TRACER.format(steps=STEPS, folder=str(notes), package=package)
        (folder / "sitecustomize.py").write_text(tracer, encoding="utf-8")
        environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)])}
        command = [
            sys.executable,
            "-m",
            "snakemake",
            "--snakefile",
            str(ROOT / "workflow/Snakefile"),
        ]
        command += ["--cores", "1", "--config", "pages=[]", "publish=[]"]
        subprocess.run(command, cwd=project, env=environment, check=True, capture_output=True)
        steps: dict[str, set[str]] = {step: set() for step in STEPS}
        for note in notes.glob("*.json"):
            for step, names in json.loads(note.read_text(encoding="utf-8")).items():
                steps[step] |= {os.path.relpath(name, ROOT) for name in names}
    return {step: sorted(names) for step, names in steps.items()}


def write_project(project: Path) -> None:
    """Write a project with one data set: noisy tones of two pitches."""
    from ajgdata.paths import Paths
    from ajgdata.store.audio import file_sha256, write_pcm24
    from ajgdata.store.sessions import write_session
    from ajgdata.types import Recording, Session

    paths = Paths(project)
    declared = {
        "name": "tones",
        "targets": {"pitch": {"kind": "classification"}},
        "tasks": {"pitch": {"target": "pitch", "folds": 2, "models": ["knn"]}},
    }
    paths.dataset("tones").parent.mkdir(parents=True)
    paths.dataset("tones").write_text(yaml.safe_dump(declared), encoding="utf-8")
    time_s = np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
    random = np.random.default_rng(0)
    folder = paths.session("tones", "day")
    recordings = []
    for number in range(RECORDINGS):
        pitch = ("low", "high")[number % 2]
        hz = {"low": 300, "high": 3000}[pitch] + 40 * number
        samples = 0.5 * np.sin(2 * np.pi * hz * time_s) + random.normal(0, 0.01, len(time_s))
        path = folder / f"audio/{number}.wav"
        write_pcm24(path, samples, RATE_HZ)
        recording = Recording(
            recording_id=str(number),
            file=f"audio/{number}.wav",
            sha256=file_sha256(path),
            grasp_id=str(number),
            labels={"pitch": pitch},
        )
        recordings.append(recording)
    write_session(folder, Session(session_id="day", source="import"), recordings)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--trace", action="store_true", help="also run the workflow")
    arguments = parser.parse_args()
    for name, figure in source_figures().items():
        print(f"{name}: {figure}")
    if arguments.trace:
        steps = traced_files()
        together = sorted(set().union(*steps.values()))
        print(f"files that one recording passes on its way to metrics.csv: {len(together)}")
        for step, names in steps.items():
            print(f"  {step} ({len(names)}): {' '.join(names)}")


if __name__ == "__main__":
    main()
