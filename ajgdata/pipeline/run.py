"""A run of the workflow: the command for some data sets alone, and the end of a run."""

from __future__ import annotations

import shlex
import subprocess
import sys
from collections.abc import Sequence
from itertools import takewhile
from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.store.provenance import PACKAGE
from ajgdata.types import DataError

#: Snakemake's options that set a configuration.
CONFIG = ("--config", "-C")
#: The summary of a run that skipped tasks ends with a line that begins with this.
INCOMPLETE = "incomplete:"


def split_arguments(arguments: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the names of data sets, which come first, and the options for Snakemake."""
    names = list(takewhile(lambda text: not text.startswith("-"), arguments))
    return names, list(arguments[len(names) :])


def with_datasets(names: Sequence[str], more: Sequence[str]) -> list[str]:
    """Return Snakemake's arguments `more`, limited to the data sets `names`: their features, tasks,
    models and a report of their own. Raises DataError for a second `--config`, because Snakemake
    uses only the last one."""
    if not names:
        return list(more)
    if any(text.split("=")[0] in CONFIG for text in more):
        problem = "is already used to choose the data sets"
        raise DataError("--config", problem, "call snakemake with your own --config")
    chosen = f"datasets=[{','.join(names)}]"
    return [*more, "--config", chosen, "alone=True", "pages=[]", "publish=[]"]


def snakefile_of(paths: Paths) -> Path:
    """Return the workflow: the project's own, else the one beside the package.

    Raises DataError where there is neither: an installed package is without.
    """
    beside = PACKAGE.parent / paths.snakefile.name
    if not (paths.snakefile.is_file() or beside.is_file()):
        problem = "there is no workflow here, and none came with the installed package"
        fix = "work in a copy of the source (git clone), or put its Snakefile and workflow/ here"
        raise DataError(paths.snakefile, problem, fix)
    return paths.snakefile if paths.snakefile.is_file() else beside


def command(paths: Paths, names: Sequence[str], more: Sequence[str] = ()) -> list[str]:
    """Return the equivalent `snakemake` command, to be given in the project's folder."""
    workflow = snakefile_of(paths)
    other = [] if workflow == paths.snakefile else ["--snakefile", str(workflow)]
    return ["snakemake", *other, *with_datasets(names, more)]


def run(paths: Paths, names: Sequence[str], more: Sequence[str] = ()) -> int:
    """Run the workflow on `names` and return its exit code; the workflow says what it did."""
    arguments = command(paths, names, more)
    print(shlex.join(arguments), flush=True)
    line = [sys.executable, "-m", *arguments]
    return subprocess.run(line, check=False, cwd=paths.root).returncode


def end_run(summary: Path, before_ns: int) -> None:
    """Print the summary of a whole run if this run wrote it; `before_ns` is its time before.

    A run that skipped tasks ends with one line and exit code 1. Its summary is removed, so that the
    next run reports the tasks again.
    """
    if modified_ns(summary) in (0, before_ns):
        return
    text = summary.read_text(encoding="utf-8")
    *_, last = text.splitlines()
    skipped = last.startswith(INCOMPLETE)
    shown = text.removesuffix(f"{last}\n") if skipped else text
    print(f"\n{shown}", flush=True)
    if skipped:
        summary.unlink()
        raise SystemExit(last)


def modified_ns(path: Path) -> int:
    """Return when a file was written, in ns; 0 if it does not exist."""
    return path.stat().st_mtime_ns if path.is_file() else 0
