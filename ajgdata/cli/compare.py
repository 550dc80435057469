"""The command that compares the results of two runs: `ajgdata compare`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from ajgdata.cli.console import ATTENTION, warn
from ajgdata.paths import Paths
from ajgdata.store.files import read_csv
from ajgdata.types import DataError

if TYPE_CHECKING:
    import pandas as pd


#: Columns of metrics.csv that identify a row.
KEYS = ["dataset", "task", "model", "part", "metric", "statistic"]
#: Parts with time and memory begin with this: they differ from run to run.
COST = "cost of "
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
    old_rows, new_rows = read_metrics(old), read_metrics(new)
    differences = compare_metrics(old_rows, new_rows)
    counts = differences["change"].value_counts()
    if len(differences):
        differences.to_csv(sys.stdout, index=False)
    summary = ", ".join(f"{counts.get(name, 0)} {name}" for name in ("removed", "new", "changed"))
    sizes = f"{len(old_rows)} rows in {old}, {len(new_rows)} in {new}"
    warn(escape(f"{sizes}: {summary}"))
    raise typer.Exit(ATTENTION if len(differences) else 0)


def read_metrics(folder: Path) -> pd.DataFrame:
    """Return the rows of metrics.csv without costs: the columns of KEYS and `value`, as text.

    Raises DataError if the table is missing, or if two rows have the same keys.
    """
    import pandas as pd

    results = Paths(folder).results
    table = (results if results.is_dir() else folder) / Paths().metrics_table.name
    rows = [
        {column: row[column] for column in (*KEYS, "value")}
        for row in read_csv(table, required=(*KEYS, "value"))[1]
        if not row["part"].startswith(COST)
    ]
    metrics = pd.DataFrame(rows, columns=[*KEYS, "value"], dtype=str)
    if metrics.duplicated(KEYS).any():
        doubled = " ".join(metrics.loc[metrics.duplicated(KEYS), KEYS].iloc[0])
        raise DataError(table, f"has two rows for {doubled!r}", "run `snakemake` again")
    return metrics


def compare_metrics(old: pd.DataFrame, new: pd.DataFrame) -> pd.DataFrame:
    """Return the rows that differ: KEYS, `change` (removed, new, changed), both values as text and
    the relative difference."""
    import pandas as pd

    rows = old.merge(new, on=KEYS, how="outer", suffixes=("_old", "_new"), indicator="change")
    names = {"left_only": "removed", "right_only": "new", "both": "changed"}
    rows["change"] = rows["change"].astype(str).map(names)
    first, second = (pd.to_numeric(rows[f"value_{run}"], errors="coerce") for run in ("old", "new"))
    larger = pd.concat([first.abs(), second.abs()], axis=1).max(axis=1)
    rows["relative_difference"] = (second - first).abs() / larger
    equal = (
        (first == second)
        | (rows["relative_difference"] <= TOLERANCE)
        | (rows["value_old"] == rows["value_new"])
    )
    return rows[~equal].sort_values(["change", *KEYS], kind="stable")
