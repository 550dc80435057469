"""The command that compares the results of two runs: `ajgdata compare`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from ajgdata.cli.console import ATTENTION, warn
from ajgdata.paths import Paths
from ajgdata.store.metrics import COST, KEYS, read_metrics
from ajgdata.types import DataError

if TYPE_CHECKING:
    import pandas as pd


#: Values are equal if they differ by at most this share of the larger one.
TOLERANCE = 1e-6

FolderArgument = Annotated[
    Path, typer.Argument(help="results folder, or a folder that contains `results/`")
]


def compare(old: FolderArgument, new: FolderArgument) -> None:
    """Compare the results of two runs, row by row.

    Prints the removed, new and changed rows of metrics.csv. Values are equal up to a relative
    difference of 1e-6. Rows on time and memory are not compared. Exit code 3 if rows differ.
    """
    old_rows, new_rows = read_scores(old), read_scores(new)
    differences = compare_metrics(old_rows, new_rows)
    counts = differences["change"].value_counts()
    if len(differences):
        differences.to_csv(sys.stdout, index=False)
    summary = ", ".join(f"{counts.get(name, 0)} {name}" for name in ("removed", "new", "changed"))
    sizes = f"{len(old_rows)} rows in {old}, {len(new_rows)} in {new}"
    warn(escape(f"{sizes}: {summary}"))
    raise typer.Exit(ATTENTION if len(differences) else 0)


def read_scores(folder: Path) -> pd.DataFrame:
    """Return the rows of metrics.csv without time and memory: the columns KEYS and `value`.

    Raises DataError if the table is missing or of another version, and if two rows have the same
    keys.
    """
    results = Paths(folder).results
    table = (results if results.is_dir() else folder) / Paths().metrics_table.name
    metrics = read_metrics(table)
    scores = metrics.loc[metrics["statistic"] != COST, [*KEYS, "value"]]
    doubled = scores.loc[scores.duplicated([*KEYS]), [*KEYS]]
    if len(doubled):
        cells = doubled.iloc[0].dropna().astype(str)
        named = " ".join(cells[cells != ""])
        raise DataError(table, f"has two rows for {named!r}", "run `snakemake` again")
    return scores


def compare_metrics(old: pd.DataFrame, new: pd.DataFrame) -> pd.DataFrame:
    """Return the rows that differ: KEYS, `change` (removed, new, changed), both values and the
    relative difference."""
    import pandas as pd

    keys = [*KEYS]
    rows = old.merge(new, on=keys, how="outer", suffixes=("_old", "_new"), indicator="change")
    names = {"left_only": "removed", "right_only": "new", "both": "changed"}
    rows["change"] = rows["change"].astype(str).map(names)
    first, second = rows["value_old"], rows["value_new"]
    larger = pd.concat([first.abs(), second.abs()], axis=1).max(axis=1)
    rows["relative_difference"] = (second - first).abs() / larger
    equal = (
        (first == second)
        | (rows["relative_difference"] <= TOLERANCE)
        | ((rows["change"] == "changed") & first.isna() & second.isna())
    )
    return rows[~equal].sort_values(["change", *keys], kind="stable")
