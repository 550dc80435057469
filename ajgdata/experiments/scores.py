"""Scores: one number per row, with a column for everything that identifies it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

from ajgdata.types.table import Table, table_of

SCORES = "scores"  #: name of the tables whose rows go into `results/metrics.csv`
PREDICTIONS = "predictions"  #: name of the tables whose rows go into `results/predictions.csv`
POSITIONS = "positions"  #: name of the table with the positions of recordings, for `map` of a task
STATISTICS = ("mean", "sd", "pooled", "chance")
_FOLD = "fold "


class ScoreKey(NamedTuple):
    """What a number is a score of. Fields that do not apply are empty: "" or None.

    `model` is a model, or the space of an embedding. `grasps` is the number of training grasps per
    class, or of calibration grasps. `dimension` is that of a space. `condition` is what else
    identifies the number: a class, a pair of classes, a stated coverage, or a variant of a
    `comparison`. For the other fields see docs/comparing.md.
    """

    model: str = ""
    split: str = ""
    test_set: str = ""
    target_values: str = ""
    grasps: int | None = None
    dimension: int | None = None
    comparison: str = ""
    condition: str = ""


class ScoreRow(NamedTuple):
    """One number: a statistic of a metric."""

    metric: str
    statistic: str
    value: float | None
    key: ScoreKey = ScoreKey()


#: Titles of the columns.
SCORE_COLUMNS = {
    name: name.replace("_", " ").capitalize()
    for name in (*ScoreKey._fields, "metric", "statistic", "value")
}


def score_table(rows: Iterable[ScoreRow], title: str) -> Table:
    """Return scores as a table.

    NaN becomes a missing value. Infinity stays: the width of an interval without an end is known.
    """
    cells = (
        {
            **row.key._asdict(),
            "metric": row.metric,
            "statistic": row.statistic,
            "value": row.value,
        }
        for row in rows
    )
    return table_of(SCORES, title, cells, **SCORE_COLUMNS)


def fold_scores(scores: Any, key: ScoreKey) -> Iterator[ScoreRow]:
    """Yield the rows of `crossval.Scores`: folds, then STATISTICS."""
    for metric, values in scores.per_fold.items():
        for fold, value in enumerate(values):
            yield ScoreRow(metric, fold_statistic(fold), value, key)
        for statistic in STATISTICS:
            yield ScoreRow(metric, statistic, getattr(scores, statistic)[metric], key)


def fold_statistic(fold: int) -> str:
    """Return the name of the statistic of one fold."""
    return f"{_FOLD}{fold}"


def is_fold(statistic: object) -> bool:
    """Return whether a statistic is the value of one fold."""
    return str(statistic).startswith(_FOLD)


def axis_column(key: str, axis: str) -> str:
    """Return the column of predictions for one axis of a vector, or for a single column ("")."""
    return f"{key}_{axis}" if axis else key
