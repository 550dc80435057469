"""Scores of two runs row by row, and scores of several runs in one table."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

from ajgdata.evaluate.fold_tests import paired_fold_test
from ajgdata.evaluate.metrics import LOWER_IS_BETTER, METRICS
from ajgdata.experiments.scores import is_fold
from ajgdata.paths import Paths
from ajgdata.pipeline.compare_rows import TOLERANCE, read_scores, results_folder
from ajgdata.store.metrics import KEYS, read_predictions
from ajgdata.types import CROSS_VALIDATION, NotPossibleError

#: Metrics that cross-validation computes in each fold.
FOLD_METRICS = (*METRICS["regression"], *METRICS["classification"])
#: Columns of predictions.csv that identify the predictions of a score.
PART = ("dataset", "task", "model", "split", "test_set", "target_values")


class ScoreName(NamedTuple):
    """Cells of KEYS that identify a score; None is an empty cell of a column of numbers."""

    dataset: str
    task: str
    experiment: str
    model: str
    split: str
    test_set: str
    target_values: str
    grasps: int | None
    dimension: int | None
    comparison: str
    condition: str
    metric: str
    statistic: str

    @property
    def part(self) -> tuple[str, ...]:
        """Return the columns of predictions.csv that identify the predictions of the score."""
        return tuple(getattr(self, name) for name in PART)

    @property
    def mean(self) -> ScoreName:
        """Return the mean over folds of the same metric."""
        return self._replace(statistic="mean")


@dataclass(frozen=True, eq=False)
class Run:
    """Scores of a run by name, and the recordings that its folds tested.

    `tested` has pairs of a recording and a fold, by `ScoreName.part`. A value of NaN is undefined.
    """

    folder: Path
    scores: Mapping[ScoreName, float]
    tested: Mapping[tuple[str, ...], frozenset[tuple[str, str]]]

    @cached_property
    def fold_values(self) -> dict[ScoreName, list[float]]:
        """Values of the folds, in the order of metrics.csv, by the name of their mean."""
        values: dict[ScoreName, list[float]] = defaultdict(list)
        for name, value in self.scores.items():
            if is_fold(name.statistic):
                values[name.mean].append(value)
        return values


class Difference(NamedTuple):
    """Difference of a value from that of another run, and its 95 % interval (NaN: unknown)."""

    value: float = math.nan
    low: float = math.nan
    high: float = math.nan


class ComparedScore(NamedTuple):
    """A score of several runs.

    `values` are in the order of the runs: None if a run lacks the score, NaN if the value is
    undefined. `differences` are those from the first run, also of the first run itself. `differs`
    is true if a value is missing, or is not equal to that of the first run.
    """

    name: ScoreName
    values: tuple[float | None, ...]
    differences: tuple[Difference, ...]
    differs: bool


def read_run(folder: Path) -> Run:
    """Return the run in a results folder, or in a folder that contains `results/`.

    Raises DataError as `read_scores` does. Without predictions.csv, `tested` is empty.
    """
    table = read_scores(folder)
    cells = table[list(KEYS)].astype(object)
    names = cells.where(cells.notna(), None).itertuples(index=False, name=None)
    scores = dict(
        zip(map(ScoreName._make, names), table["value"].astype(float).tolist(), strict=True)
    )
    tested: dict[tuple[str, ...], set[tuple[str, str]]] = defaultdict(set)
    predictions = results_folder(folder) / Paths().predictions.name
    if predictions.is_file():
        for row in read_predictions(predictions):
            part = tuple(row[name] for name in PART)
            tested[part].add((row["recording"], row["fold"]))
    return Run(folder, scores, {part: frozenset(pairs) for part, pairs in tested.items()})


def compare_runs(runs: Sequence[Run]) -> list[ComparedScore]:
    """Return the scores of all runs, compared with the first run, in the order of metrics.csv.

    Values of single folds are not listed if their mean is, because they are in its interval.
    """
    first = runs[0]
    names = dict.fromkeys(name for run in runs for name in run.scores)
    compared = []
    for name in names:
        if is_fold(name.statistic) and name.mean in names:
            continue
        values = tuple(run.scores.get(name) for run in runs)
        compared.append(
            ComparedScore(
                name,
                values,
                differences=tuple(difference(first, run, name) for run in runs),
                differs=not all(is_equal(values[0], value) for value in values),
            )
        )
    return compared


def is_equal(before: float | None, after: float | None) -> bool:
    """Return whether two values are equal up to TOLERANCE, or both are undefined.

    A missing value, None, is not equal to any value.
    """
    if before is None or after is None:
        return False
    if math.isnan(before) or math.isnan(after):
        return math.isnan(before) and math.isnan(after)
    return math.isclose(before, after, rel_tol=TOLERANCE)


def difference(first: Run, other: Run, name: ScoreName) -> Difference:
    """Return a score of the run `other` minus that of the run `first`; NaN if a run lacks it.

    The interval is that of `paired_fold_test`, paired if each fold tested the same recordings in
    both runs. It is only known for means over the same number of folds of a cross-validation.
    """
    before = first.scores.get(name, math.nan)
    after = other.scores.get(name, math.nan)
    change = after - before
    old_folds = first.fold_values.get(name, [])
    new_folds = other.fold_values.get(name, [])
    old_tests = first.tested.get(name.part)
    new_tests = other.tested.get(name.part)
    is_cross_validation = name.experiment == CROSS_VALIDATION and name.metric in FOLD_METRICS
    has_tests = old_tests is not None and new_tests is not None
    if not is_cross_validation or not has_tests or len(old_folds) != len(new_folds):
        return Difference(change)
    if len(old_folds) < 2:
        return Difference(change)
    is_paired = old_tests == new_tests
    try:
        test = paired_fold_test(old_folds, new_folds, metric=name.metric, paired=is_paired)
    except NotPossibleError:  # a fold has no value
        return Difference(change)
    if name.metric in LOWER_IS_BETTER:  # a gain is then a negative difference
        return Difference(change, -test.high, -test.low)
    return Difference(change, test.low, test.high)
