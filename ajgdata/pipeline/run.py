"""A run of the workflow: the command for some data sets alone, and the end of a run."""

from __future__ import annotations

import dataclasses
import re
import shlex
import subprocess
import sys
from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path

from ajgdata.paths import Paths, run_name
from ajgdata.store.provenance import PACKAGE
from ajgdata.types import NAME, DataError

KEY = "datasets="
#: Pages on the virtual gripper and trees for others are no part of such a run.
WITHOUT = ("pages=[]", "publish=[]")
#: Rules that a person asks for by name begin so.
REPORT = "report_"
#: Snakemake's words for what is to be set otherwise than its configuration says.
CONFIG = ("--config", "-C")
#: And for looking at what a run would do.
LOOKING = {"--dry-run", "--dryrun", "-n"}
#: The summary of a run that skipped tasks ends with a line that begins with this.
INCOMPLETE = "incomplete:"


def only(names: Sequence[str]) -> list[str]:
    """Return Snakemake's arguments for the data sets `names`: features, tasks, models, and a report
    of their own."""
    return ["--config", f"{KEY}[{','.join(names)}]", "alone=True", *WITHOUT] if names else []


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


def snakefile_arguments(paths: Paths) -> list[str]:
    """Return what Snakemake must be told in the project's folder: nothing, if it has a workflow of
    its own. Raises DataError where there is none."""
    found = snakefile_of(paths)
    return [] if found == paths.snakefile else ["--snakefile", str(found)]


def command(paths: Paths, names: Sequence[str], more: Sequence[str] = ()) -> list[str]:
    """Return the equivalent `snakemake` command, to be given in the project's folder."""
    return ["snakemake", *snakefile_arguments(paths), *with_only(names, more)]


def with_only(names: Sequence[str], more: Sequence[str]) -> list[str]:
    """Return Snakemake's arguments `more` with those for the data sets `names`.

    Of several `--config` Snakemake takes the last alone, hence all stand in one, at the end: what
    follows it would be taken for values, too. Where both say the same, `more` holds.
    """
    config, others, values = only(names)[1:], list[str](), False
    for one in more:
        flag, equals, value = one.partition("=")
        if flag in CONFIG:
            values = not equals
            config += [value] if equals else []
        elif values and not one.startswith("-"):
            config.append(one)
        else:
            values = False
            others.append(one)
    return [*others, "--config", *config] if config else others


def parted(arguments: Sequence[str], known: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the names of data sets that `arguments` begin with, and the rest, for Snakemake.

    Raises DataError for a word after the names that is no data set, no option, no file and no
    report: it is misspelt.
    """
    count = next((n for n, one in enumerate(arguments) if one not in known), len(arguments))
    rest = list(arguments[count:])
    if rest and NAME.match(rest[0]) and not rest[0].startswith(REPORT):
        near = get_close_matches(rest[0], known, 1)
        here = f"declared here: {', '.join(known) or 'none'}"
        raise DataError(rest[0], "no such data set", f"did you mean {near[0]}?" if near else here)
    return list(arguments[:count]), rest


def datasets_asked(arguments: Sequence[str]) -> list[str] | None:
    """Return the data sets that Snakemake's arguments name (`datasets=[a, b]`), None for all."""
    given = [one.removeprefix(KEY) for one in arguments if one.startswith(KEY)]
    return re.findall(r"[\w-]+", given[-1]) if given and given[-1] != "null" else None


def run(paths: Paths, names: Sequence[str], more: Sequence[str] = ()) -> int:
    """Run the workflow on `names` and return its exit code; the workflow says what it did.

    If everything was there already, so that no job ran, the summary is told again.
    """
    asked = command(paths, names, more)
    print(shlex.join(asked), flush=True)
    paths = dataclasses.replace(paths, run=run_name(datasets_asked(asked) or ()))
    before = modified_ns(paths.complete)
    line = [sys.executable, "-m", *asked]
    code = subprocess.run(line, check=False, cwd=paths.root).returncode
    unchanged = before == modified_ns(paths.complete)
    if code == 0 and before and unchanged and not LOOKING & set(more):
        print(paths.complete.read_text(encoding="utf-8"), end="")
    return code


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
    print(f"\n{shown}", file=sys.stderr, flush=True)
    if skipped:
        summary.unlink()
        raise SystemExit(last)


def modified_ns(path: Path) -> int:
    """Return when a file was written, in ns; 0 if it does not exist."""
    return path.stat().st_mtime_ns if path.is_file() else 0
