"""`ajgdata compare`: compare the results of two runs."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from ajgdata.cli.console import ATTENTION, JsonOption, print_json, warn
from ajgdata.paths import Paths
from ajgdata.store.metrics import COST, KEYS, read_metrics
from ajgdata.types import DataError

if TYPE_CHECKING:
    import pandas as pd

#: Largest relative difference of equal values.
TOLERANCE = 1e-6
#: Values of the column `change`, by the tables that have the row (names of pandas).
CHANGES = {"left_only": "removed", "right_only": "new", "both": "changed"}

FolderArgument = Annotated[
    Path, typer.Argument(help="results folder, or a folder that contains `results/`")
]


def compare(old: FolderArgument, new: FolderArgument, as_json: JsonOption = False) -> None:
    """Compare the results of two runs, row by row.

    Prints the removed, new and changed rows of metrics.csv. Values are equal up to a relative
    difference of 1e-6. Rows on time and memory are not compared. Exit code 3 if rows differ.
    """
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
    raise typer.Exit(ATTENTION if len(differences) else 0)


def read_scores(folder: Path) -> pd.DataFrame:
    """Return the columns KEYS and `value` of metrics.csv, without the rows on time and memory.

    Raises DataError if the table is missing, if another version of ajgdata wrote it, or if two rows
    have the same keys.
    """
    results = Paths(folder).results
    if not results.is_dir():
        results = folder
    table = results / Paths().metrics_table.name
    metrics = read_metrics(table)
    scores = metrics.loc[metrics["statistic"] != COST, [*KEYS, "value"]]
    repeated = scores.loc[scores.duplicated(list(KEYS)), list(KEYS)]
    if len(repeated):
        cells = repeated.iloc[0].dropna().astype(str)
        name = " ".join(cells[cells != ""])
        raise DataError(table, f"has two rows for {name!r}", "run `snakemake` again")
    return scores


def compare_metrics(old: pd.DataFrame, new: pd.DataFrame) -> pd.DataFrame:
    """Return the rows that differ between two tables of `read_scores`.

    The columns are KEYS, `change` (removed, new or changed), `value_old`, `value_new` and
    `relative_difference`.
    """
    import pandas as pd

    keys = list(KEYS)
    rows = old.merge(new, on=keys, how="outer", suffixes=("_old", "_new"), indicator="change")
    rows["change"] = rows["change"].astype(str).map(CHANGES)
    before = rows["value_old"]
    after = rows["value_new"]
    larger = pd.concat([before.abs(), after.abs()], axis=1).max(axis=1)
    rows["relative_difference"] = (after - before).abs() / larger
    both_undefined = (rows["change"] == "changed") & before.isna() & after.isna()
    is_equal = (before == after) | (rows["relative_difference"] <= TOLERANCE) | both_undefined
    return rows[~is_equal].sort_values(["change", *keys], kind="stable")


def _json_rows(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the rows of a table. Cells that are missing or empty are None."""
    import pandas as pd

    return [
        {str(name): None if pd.isna(cell) or cell == "" else cell for name, cell in row.items()}
        for row in table.astype(object).to_dict("records")
    ]
