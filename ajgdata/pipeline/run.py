"""A run of the workflow on some data sets alone: the command that a person would give."""

from __future__ import annotations

import dataclasses
import re
import shlex
import subprocess
import sys
from collections.abc import Sequence

from ajgdata.paths import Paths, run_name
from ajgdata.store.provenance import PACKAGE

KEY = "datasets="
#: Pages on the virtual gripper and trees for others are no part of such a run.
WITHOUT = ("pages=[]", "publish=[]")
#: Snakemake's words for what is to be set otherwise than its configuration says.
CONFIG = ("--config", "-C")
#: And for looking at what a run would do.
LOOKING = {"--dry-run", "--dryrun", "-n"}


def only(names: Sequence[str]) -> list[str]:
    """Return Snakemake's arguments for the data sets `names`: features, tasks, models, and a report
    of their own."""
    return ["--config", f"{KEY}[{','.join(names)}]", "alone=True", *WITHOUT] if names else []


def snakefile_arguments(paths: Paths) -> list[str]:
    """Return what Snakemake must be told in the project's folder: nothing, if it has a workflow of
    its own."""
    if paths.snakefile.is_file():
        return []
    return ["--snakefile", str(PACKAGE.parent / "Snakefile")]


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
    """Return the names of data sets that `arguments` begin with, and the rest, for Snakemake."""
    count = next((n for n, one in enumerate(arguments) if one not in known), len(arguments))
    return list(arguments[:count]), list(arguments[count:])


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
    told = _written(paths)
    line = [sys.executable, "-m", *asked]
    code = subprocess.run(line, check=False, cwd=paths.root).returncode
    if code == 0 and told and told == _written(paths) and not LOOKING & set(more):
        print(paths.complete.read_text(encoding="utf-8"), end="")
    return code


def _written(paths: Paths) -> int:
    return paths.complete.stat().st_mtime_ns if paths.complete.is_file() else 0
