"""metrics.csv and predictions.csv: all numbers of a run, with the columns that identify them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ajgdata.paths import command_for
from ajgdata.store.files import csv_bytes, read_csv, write_bytes
from ajgdata.types import DataError
from ajgdata.types.formats import FORMAT_KEY, METRICS_FORMAT

if TYPE_CHECKING:
    import pandas as pd

#: Columns that identify a number, in the order of the file.
KEYS = (
    "dataset",
    "task",
    "experiment",
    "model",
    "split",
    "test_set",
    "target_values",
    "grasps",
    "dimension",
    "comparison",
    "condition",
    "metric",
    "statistic",
)
#: Other columns. `groups` is the column whose values a grouped split does not divide, and `reason`
#: states why there is no value.
FACTS = ("value", "unit", "groups", "source", "seed", "commit", "reason", FORMAT_KEY)
#: Statistic of run time and memory, which differ between runs.
COST = "cost"
#: Columns of whole numbers, which can be empty.
COUNTS = ("grasps", "dimension", "seed", FORMAT_KEY)
PREDICTION_COLUMNS = (
    "dataset",
    "task",
    "model",
    "recording",
    "split",
    "test_set",
    "target_values",
    "fold",
    "y_true",
    "y_pred",
    "probability",
    FORMAT_KEY,
)


def write_metrics(path: Path, rows: Iterable[Mapping[str, Any]]) -> None:
    """Write numbers; a row has KEYS and FACTS without `format`. None becomes an empty cell."""
    cells = (
        {key: "" if value is None else value for key, value in row.items()}
        | {FORMAT_KEY: METRICS_FORMAT.version}
        for row in rows
    )
    write_bytes(path, csv_bytes((*KEYS, *FACTS), cells))


def read_metrics(path: Path) -> pd.DataFrame:
    """Return the numbers in `path`: one row per number, with the columns KEYS and FACTS.

    `value` is float64 (NaN: undefined, see `reason`), COUNTS are Int64 (missing: does not apply),
    and all other columns are text ("": does not apply). Raises DataError for a missing file, and
    for a file of another version.
    """
    import pandas as pd  # the command line imports this module when it starts

    rows = _rows_of_this_version(path, required=("value",))
    metrics = pd.DataFrame(rows, columns=[*KEYS, *FACTS], dtype=str)
    for name in ("value", *COUNTS):
        try:
            metrics[name] = pd.to_numeric(metrics[name])
        except ValueError as error:
            fix = METRICS_FORMAT.fix(command_for(path))
            raise DataError(path, f"column {name}: {error}", fix) from None
    return metrics.astype({"value": "float64", **dict.fromkeys(COUNTS, "Int64")})


def write_predictions(path: Path, rows: Iterable[Mapping[str, Any]]) -> None:
    """Write predictions; a row has PREDICTION_COLUMNS without `format`.

    Rows of a vector have y_true and y_pred of each axis instead, e.g. `y_true_x_m`, in additional
    columns at the end.
    """
    cells = [{**row, FORMAT_KEY: METRICS_FORMAT.version} for row in rows]
    columns = dict.fromkeys(PREDICTION_COLUMNS)
    for row in cells:
        columns.update(dict.fromkeys(row))
    write_bytes(path, csv_bytes(list(columns), cells))


def read_predictions(path: Path) -> list[dict[str, str]]:
    """Return the predictions in `path`: rows of PREDICTION_COLUMNS, as text.

    Raises DataError as `read_metrics` does.
    """
    return _rows_of_this_version(path, required=("y_true", "y_pred"))


def _rows_of_this_version(path: Path, required: Iterable[str]) -> list[dict[str, str]]:
    """Return the rows of a file of METRICS_FORMAT. Raises DataError for another version."""
    command = command_for(path)
    header, rows = read_csv(path, required)
    if FORMAT_KEY not in header:
        METRICS_FORMAT.check(path, None, command)
    for version in sorted({row[FORMAT_KEY] for row in rows}):
        METRICS_FORMAT.check(path, int(version) if version.isdecimal() else version, command)
    return rows
