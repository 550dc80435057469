"""Rows of metrics.csv of two runs that differ."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from ajgdata.paths import Paths
from ajgdata.store.metrics import COST, KEYS, read_metrics
from ajgdata.types import DataError

#: Largest relative difference of equal values.
TOLERANCE = 1e-6
#: Values of the column `change`, by the tables that have the row (names of pandas).
CHANGES = {"left_only": "removed", "right_only": "new", "both": "changed"}


def read_scores(folder: Path) -> pd.DataFrame:
    """Return the columns KEYS and `value` of metrics.csv, without the rows on time and memory.

    Raises DataError if the table is missing, if another version of ajgdata wrote it, or if two rows
    have the same keys.
    """
    table = results_folder(folder) / Paths().metrics_table.name
    metrics = read_metrics(table)
    scores = metrics.loc[metrics["statistic"] != COST, [*KEYS, "value"]]
    repeated = scores.loc[scores.duplicated(list(KEYS)), list(KEYS)]
    if len(repeated):
        cells = repeated.iloc[0].dropna().astype(str)
        name = " ".join(cells[cells != ""])
        raise DataError(table, f"has two rows for {name!r}", "run `snakemake` again")
    return scores


def results_folder(folder: Path) -> Path:
    """Return the results in a folder: those of a project, of its only run, or the folder itself.

    Raises DataError if a project has results only of several runs of selected data sets.
    """
    paths = Paths(folder)
    if not paths.results.is_dir():
        return folder
    if paths.metrics_table.is_file():
        return paths.results
    runs = sorted(
        table.parent for table in paths.results.glob(f"runs/*/{Paths().metrics_table.name}")
    )
    if len(runs) > 1:
        listed = ", ".join(str(run) for run in runs)
        raise DataError(paths.results, "has results of several runs", f"name one of {listed}")
    return runs[0] if runs else paths.results


def compare_metrics(old: pd.DataFrame, new: pd.DataFrame) -> pd.DataFrame:
    """Return the rows that differ between two tables of `read_scores`.

    The columns are KEYS, `change` (removed, new or changed), `value_old`, `value_new` and
    `relative_difference`.
    """
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
