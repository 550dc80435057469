"""`ajgdata compare`: compare the results of two or more runs."""

from __future__ import annotations

import csv
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from ajgdata.cli.console import ATTENTION, JsonOption, print_json, warn
from ajgdata.types import many

if TYPE_CHECKING:
    import pandas as pd

    from ajgdata.pipeline.compare_runs import ComparedScore, Run


def compare(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN RUN [RUN]...",
            help="results folders, or folders that contain `results/`",
            show_default=False,
        ),
    ],
    is_wide: Annotated[
        bool, typer.Option("--wide", help="one column per run, also for two runs")
    ] = False,
    everything: Annotated[
        bool, typer.Option("--all", help="table, also with scores that are equal in all runs")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Compare the results of two or more runs.

    For two runs, prints the removed, new and changed rows of metrics.csv. For more runs, prints
    one row per score that differs: its value in each run, the differences from the first run with
    95 % intervals, and the runs that lack it. Values are equal up to a relative difference of 1e-6.
    Rows on time and memory are not compared. Exit code 3 if rows differ.
    """
    if len(runs) < 2:
        raise typer.BadParameter("name two or more runs")
    if len(set(runs)) < len(runs):
        raise typer.BadParameter("a run is named twice")
    if len(runs) == 2 and not is_wide and not everything:
        are_equal = _list_changes(runs[0], runs[1], as_json=as_json)
    else:
        are_equal = _show_table(runs, everything=everything, as_json=as_json)
    raise typer.Exit(0 if are_equal else ATTENTION)


def _list_changes(old: Path, new: Path, *, as_json: bool) -> bool:
    """Print the rows that differ between two runs; return whether there are none."""
    from ajgdata.pipeline.compare_rows import CHANGES, compare_metrics, read_scores

    old_rows = read_scores(old)
    new_rows = read_scores(new)
    differences = compare_metrics(old_rows, new_rows)
    counts = {name: int((differences["change"] == name).sum()) for name in CHANGES.values()}
    if as_json:
        print_json(
            {
                "old": str(old),
                "new": str(new),
                "n_rows_old": len(old_rows),
                "n_rows_new": len(new_rows),
                **{f"n_{name}": count for name, count in counts.items()},
                "differences": _json_rows(differences),
            }
        )
    else:
        if len(differences):
            differences.to_csv(sys.stdout, index=False, lineterminator="\n")
        summary = ", ".join(f"{count} {name}" for name, count in counts.items())
        sizes = f"{len(old_rows)} rows in {old}, {len(new_rows)} in {new}"
        warn(escape(f"{sizes}: {summary}"))
    return differences.empty


def _json_rows(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the rows of a table. Cells that are missing or empty are None."""
    import pandas as pd

    return [
        {str(name): None if pd.isna(cell) or cell == "" else cell for name, cell in row.items()}
        for row in table.astype(object).to_dict("records")
    ]


def _show_table(folders: Sequence[Path], *, everything: bool, as_json: bool) -> bool:
    """Print the scores of several runs; return whether all scores are equal.

    Scores that are equal in all runs are only printed with `everything`.
    """
    from ajgdata.pipeline.compare_runs import compare_runs, read_run

    runs = [read_run(folder) for folder in folders]
    scores = compare_runs(runs)
    n_different = sum(score.differs for score in scores)
    shown = [score for score in scores if everything or score.differs]
    missing = {
        str(run.folder): sum(score.values[at] is None for score in scores)
        for at, run in enumerate(runs)
    }
    if as_json:
        print_json(
            {
                "runs": [{"folder": name, "n_missing": count} for name, count in missing.items()],
                "n_scores": len(scores),
                "n_different": n_different,
                "scores": [_json_score(score, list(missing)) for score in shown],
            }
        )
    else:
        _print_csv(shown, list(missing))
        warn(escape(f"{len(scores)} scores in {len(runs)} runs: {n_different} differ"))
        for name, count in missing.items():
            if count:
                warn(escape(f"{name}: {many(count, 'score')} missing"))
        _warn_of_runs_without_intervals(runs)
    return n_different == 0


def _json_score(score: ComparedScore, names: Sequence[str]) -> dict[str, Any]:
    """Return a score as an object of JSON; `names` are those of the runs."""
    cells = {key: None if cell == "" else cell for key, cell in score.name._asdict().items()}
    runs = [
        {
            "folder": name,
            "is_missing": value is None,
            "value": value,
            "difference": change.value,
            "low": change.low,
            "high": change.high,
        }
        for name, value, change in zip(names, score.values, score.differences, strict=True)
    ]
    return {**cells, "runs": runs}


def _print_csv(scores: Sequence[ComparedScore], names: Sequence[str]) -> None:
    """Print scores as CSV with one row per score; `names` are those of the runs."""
    from ajgdata.store.metrics import KEYS

    header = [*KEYS, *names]
    for name in names[1:]:
        header += [f"{column}: {name}" for column in ("difference", "low", "high")]
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow([*header, "missing"])
    for score in scores:
        row = [*score.name, *map(_cell, score.values)]
        for change in score.differences[1:]:
            row += map(_cell, change)
        absent = [name for name, value in zip(names, score.values, strict=True) if value is None]
        table.writerow([*row, ", ".join(absent)])
    sys.stdout.flush()


def _cell(value: float | None) -> str:
    """Return a value as a cell; a missing or undefined value is empty."""
    is_empty = value is None or math.isnan(value)
    return "" if is_empty else repr(value)


def _warn_of_runs_without_intervals(runs: Sequence[Run]) -> None:
    """Print which runs lack the predictions that intervals need."""
    for run in runs:
        if not run.tested:
            warn(escape(f"{run.folder}: no predictions.csv, so differences have no interval"))
