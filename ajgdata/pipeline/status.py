"""State of a project: current results, stale ones with the reason, data that needs attention."""

from __future__ import annotations

import csv
import io
import subprocess
import sys
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.plan import recorded_sessions
from ajgdata.pipeline.recipes import recipe_sessions
from ajgdata.pipeline.run import snakefile_of
from ajgdata.store.findings import read_findings
from ajgdata.store.sessions import list_datasets, list_sessions, read_dataset, read_recordings
from ajgdata.types import DataError, left_out

#: Snakemake's words for a file that is old only because something before it is.
FOLLOWS = ("ok", "no update")
#: Columns of its summary: file, date, rule, log files, status, plan.
COLUMNS = 6


@dataclass(frozen=True)
class Group:
    """Results of one rule that would be made again for the same reason."""

    rule: str
    reason: str
    files: tuple[str, ...]


def workflow_status(paths: Paths, more: Sequence[str] = ()) -> tuple[int, list[Group]]:
    """Return the number of current results, and the others in groups, in the order of the work.

    Asks Snakemake (`snakemake --summary`, with the arguments `more`), which runs nothing and, told
    that this is a dry run, writes no log. Raises DataError with what Snakemake complains of.
    """
    snakefile = str(snakefile_of(paths))
    command = [sys.executable, "-m", "snakemake", "--snakefile", snakefile, "--directory"]
    command += [str(paths.root), "--summary", "--dry-run", *more]
    both = subprocess.STDOUT  # a dry run says on the one what other runs say on the other
    done = subprocess.run(command, check=False, stdout=subprocess.PIPE, stderr=both, text=True)
    said = [line for line in done.stdout.splitlines() if line.strip()]
    if done.returncode:
        problem = said[-1].strip() if said else "snakemake stopped without a word"
        raise DataError(paths.root, problem, "`snakemake --dry-run` says more")
    return summarised("\n".join(line for line in said if line.count("\t") == COLUMNS - 1))


def summarised(table: str) -> tuple[int, list[Group]]:
    """Return the number of current files in Snakemake's summary, and the others in groups."""
    current, grouped = 0, defaultdict(list)
    for row in csv.DictReader(io.StringIO(table), delimiter="\t"):
        if row["plan"] == "no update":
            current += 1
        else:
            reason = "what it is made from" if row["status"] in FOLLOWS else row["status"]
            grouped[row["rule"], reason].append(row["output_file"])
    groups = [Group(rule, reason, tuple(files)) for (rule, reason), files in grouped.items()]
    return current, groups[::-1]  # Snakemake begins at the end


def data_status(paths: Paths, only: Sequence[str] | None = None) -> list[str]:
    """Return a line for each thing that no run of the workflow mends, of all data sets or of
    `only` those."""
    lines = []
    for name in list_datasets(paths) if only is None else only:
        spec = read_dataset(paths, name)
        ready = recorded_sessions(paths, spec)
        if spec.recipe:
            left = [one for one in recipe_sessions(paths, name) if one not in ready]
            if left:
                lines.append(f"{name}: {len(left)} sessions to be recorded by the virtual gripper")
        elif not list_sessions(paths, name):
            lines.append(
                f"{name}: declared, no recordings; `ajgdata import FOLDER --dataset {name}`"
            )
        lines += [line for one in ready for line in _session(paths.session(name, one), name)]
        quarantine = paths.quarantine(name)
        if out := left_out(read_findings(quarantine) if quarantine.is_file() else ()):
            lines.append(f"{name}: {len(out)} recordings left out; {quarantine}")
    return lines


def _session(folder: Path, dataset: str) -> list[str]:
    try:
        recordings, _ = read_recordings(folder)
    except DataError as error:
        return [f"{dataset}/{folder.name}: {error.problem}; {error.fix}"]
    unsealed = sum(not one.sha256 for one in recordings)
    fix = f"`ajgdata seal {dataset}` writes their hashes"
    return [f"{dataset}/{folder.name}: {unsealed} recordings not sealed; {fix}"] if unsealed else []
