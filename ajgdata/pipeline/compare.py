"""Two runs, each a folder, a file or a commit -> what changed between them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ajgdata.paths import TABLES, Paths, find_project
from ajgdata.pipeline.collect import COLUMNS, PREDICTION_COLUMNS
from ajgdata.pipeline.exports import BESIDE_PAPER, PAPER_KEYS
from ajgdata.report.run_context import Described, Rows, known_folds
from ajgdata.report.run_context import flips as compare_predictions
from ajgdata.report.run_context import settings as compare_settings
from ajgdata.report.run_context import verdicts as compare_verdicts
from ajgdata.report.run_difference import Numbers, compare_numbers, numbers_of
from ajgdata.report.run_tables import RunComparison, RunLabel
from ajgdata.store.files import read_csv, read_json, sha256_of, write_bytes
from ajgdata.store.provenance import commit_named
from ajgdata.store.runs import KeptRun, kept_runs
from ajgdata.types import DataError

_HASH = re.compile(r"[0-9a-f]{4,40}\+?")
_HERE = Paths()
_NUMBERS, _DOCUMENT = _HERE.metrics_table.name, _HERE.all_metrics.name
_PREDICTIONS, _CACHE = _HERE.predictions.name, _HERE.kept_runs
_BESIDE_PAPER = (_HERE.report.parent / TABLES / f"{BESIDE_PAPER}.csv").relative_to(_HERE.results)


@dataclass(frozen=True, eq=False)
class Run:
    """One of both runs: as it was asked for, its metrics.csv, and its rows; None: it has none."""

    name: str
    table: Path
    rows: Rows
    document: Mapping[str, Any]
    predictions: Rows | None
    beside_paper: Rows | None
    note: str = ""

    @property
    def label(self) -> RunLabel:
        """Return what it is called, with the commits that made its results."""
        commits = {row["commit"] for row in self.rows if row["commit"]}
        return RunLabel(self.name, tuple(sorted(commits)), self.note)

    @property
    def described(self) -> Described:
        """Return what it says of how it was made."""
        return Described(self.document, self.rows)


def compare_runs(a: str, b: str) -> RunComparison:
    """Compare two runs: folders of a project or of results, files of metrics, or commits.

    Raises DataError for what is no run, and for a commit of which none is kept.
    """
    first, second = read_run(a), read_run(b)
    before, after = first.predictions or (), second.predictions or ()
    numbers = _numbers(first), _numbers(second)
    absent = {
        f"predictions ({_PREDICTIONS})": [r.name for r in (first, second) if r.predictions is None],
        f"agreement with the paper ({_BESIDE_PAPER})": [
            r.name for r in (first, second) if r.beside_paper is None
        ],
        "settings": [r.name for r in (first, second) if "experiments" not in r.document],
    }
    return RunComparison(
        first.label,
        second.label,
        compare_numbers(*numbers, same_folds=known_folds(before, after)),
        tuple(compare_predictions(before, after, numbers[1])),
        tuple(compare_verdicts(first.beside_paper or (), second.beside_paper or ())),
        tuple(compare_settings(first.described, second.described)),
        tuple(f"{what}: not in {' nor '.join(names)}" for what, names in absent.items() if names),
    )


def write_page(found: RunComparison, page: Path) -> None:
    """Write the page on what changed: one HTML file."""
    from ajgdata.report.run_page import render_comparison

    try:
        project = find_project()
    except FileNotFoundError:
        project = None
    write_bytes(page, render_comparison(found, project).encode())


def _numbers(run: Run) -> Numbers:
    try:
        return numbers_of(run.rows)
    except ValueError as error:
        raise DataError(run.table, str(error), "make it again with `snakemake`") from None


def read_run(name: str) -> Run:
    """Return the run that a person names: what is on disk comes before a commit of that name.

    Raises DataError.
    """
    given, note = Path(name), ""
    if given.is_file() and given.name not in (_NUMBERS, _DOCUMENT):
        return Run(name, given, read_csv(given, COLUMNS)[1], {}, None, None)  # a table by itself
    if given.is_file():
        folder = given.parent
    elif given.is_dir():
        results = Paths(given).results
        folder = results if results.is_dir() else given
    else:
        folder, note = _kept(name)
    table = folder / _NUMBERS
    if not table.is_file():
        fix = "make it with `snakemake` (rule collect), or name the folder that has it"
        raise DataError(table, "there is no such file", fix)
    file = folder / _DOCUMENT
    document = read_json(file) if file.is_file() else {}
    if not isinstance(document, dict):
        raise DataError(file, "holds no keys", "delete it and run again")
    for one, digest in document.get("sha256", {}).items():
        _check_bytes(folder / one, digest)
    return Run(
        name=name,
        table=table,
        rows=read_csv(table, COLUMNS)[1],
        document=document,
        predictions=_optional(folder / _PREDICTIONS, PREDICTION_COLUMNS),
        beside_paper=_optional(folder / _BESIDE_PAPER, PAPER_KEYS),
        note=note,
    )


def _optional(path: Path, columns: Sequence[str]) -> Rows | None:
    return read_csv(path, columns)[1] if path.is_file() else None


def _check_bytes(path: Path, digest: str) -> None:
    """Raise DataError for a table that is there and not the one that its document tells of."""
    if path.is_file() and sha256_of(path.read_bytes()) != digest:
        problem = f"is not what {_DOCUMENT} tells of (sha256 differs)"
        raise DataError(path, problem, "make both again with `snakemake` (rule collect)")


def _kept(name: str) -> tuple[Path, str]:
    """Return the folder of the run that is kept of a commit, and what is to be known of it.

    Raises DataError if there is none.
    """
    try:
        paths = find_project()
    except FileNotFoundError as error:
        raise DataError(name, "there is no such file or folder", str(error)) from None
    kept = kept_runs(paths)
    clean = commit_named(name.removesuffix("+"), paths.root)
    wanted = f"{clean}+" if clean and name.endswith("+") else clean
    if not wanted and _HASH.fullmatch(name):  # of a repository that is not here
        wanted = next((one.commit for one in kept if one.commit.startswith(name)), "")
    found = [one for one in kept if one.commit in (wanted, f"{clean}+")]
    found.sort(key=lambda one: one.commit != wanted)  # that of a changed tree comes last
    if found:
        return found[0].folder, _said_of(found, wanted)
    if not wanted:
        problem = "is no file, no folder and no commit of this project"
        raise DataError(name, problem, _offer(kept))
    short, beside = wanted[:10], f"../{paths.root.absolute().name}-{wanted[:10]}"
    raise DataError(
        name,
        f"no run of commit {short} is kept",
        f"make it: git worktree add {beside} {short} && (cd {beside} && snakemake), then compare "
        f"with {beside}; {_offer(kept)}",
    )


def _said_of(found: Sequence[KeptRun], wanted: str) -> str:
    alike = sum(one.commit == found[0].commit for one in found)
    said = []
    if found[0].commit != wanted:
        said.append("made when the files had changes that were not committed")
    if alike > 1:
        said.append(f"the newest of {alike} runs of this commit; the others: {_CACHE}")
    return "; ".join(said)


def _offer(kept: Sequence[KeptRun]) -> str:
    """Return which runs there are to compare with."""
    commits = list(dict.fromkeys(one.commit[:10] + "+" * one.commit.endswith("+") for one in kept))
    return f"runs are kept of {', '.join(commits)}" if commits else "no run is kept yet"
