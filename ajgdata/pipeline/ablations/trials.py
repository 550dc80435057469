"""One hypothesis, one change, errors before and after, a verdict: a row of a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ajgdata.evaluate.crossval import CrossValidation, Scores
from ajgdata.evaluate.paired_fold_test import Expected, paired_fold_test
from ajgdata.models import model_label
from ajgdata.types import Kind
from ajgdata.types.table import Column, Table, Value

NAMES = {"rmse": "RMSE", "accuracy": "accuracy", "r2": "R²"}


class Folds(NamedTuple):
    """A metric of each fold, and the process seconds that training took."""

    values: tuple[float, ...]
    seconds: float


def folds_of(found: CrossValidation, metric: str, part: str | None = None) -> Folds:
    """`metric` of each fold, of the grasps held out or of a `part` of extra rows."""
    scores: Scores = found.scores if part is None else found.extra_tests[part].scores
    return Folds(scores.per_fold[metric], found.cost.train_cpu_s)


@dataclass(frozen=True)
class Hypothesis:
    """A reason why simulation and paper might differ in figures `of` the paper: if `claim` holds,
    `change` makes the result better, or worse, as `expected`."""

    of: tuple[str, ...]
    claim: str
    change: str
    expected: Expected = "better"


@dataclass(frozen=True)
class Trial:
    """A hypothesis put to the test with one model: fold values of `metric` before and after."""

    hypothesis: Hypothesis
    model: str
    metric: str
    unit: str
    before: Folds
    after: Folds
    paired: bool = True

    def row(self) -> dict[str, Value]:
        """Its row of the table, with the verdict."""
        before, after = self.before.values, self.after.values
        lower = self.metric == "rmse"
        found = paired_fold_test(before, after, lower_is_better=lower, paired=self.paired)
        kind: Kind = "classification" if self.metric == "accuracy" else "regression"
        return {
            "hypothesis": self.hypothesis.claim,
            "change": self.hypothesis.change,
            "expected": self.hypothesis.expected,
            "model": model_label(self.model, kind),
            "metric": NAMES[self.metric] + (f" ({self.unit})" if self.unit else ""),
            "before": float(np.mean(before)),
            "before_sd": float(np.std(before, ddof=1)),
            "after": float(np.mean(after)),
            "after_sd": float(np.std(after, ddof=1)),
            "gain": found.gain,
            "gain_low": found.low,
            "gain_high": found.high,
            "verdict": found.verdict(self.hypothesis.expected),
            "seconds": self.before.seconds + self.after.seconds,
            "of": " ".join(self.hypothesis.of),
        }


def trial_table(name: str, title: str, note: str, trials: Sequence[Trial]) -> Table:
    """The trials of an ablation."""
    return Table(
        name,
        title,
        f"{note} Mean and standard deviation over folds, whose grasps were never trained on unless"
        " the change is the split. Gain: improvement and its 95 % interval, corrected for folds"
        " that share training grasps. Supported: the interval lies on the expected side of 0;"
        " refuted: on the other; not supported: on both. Each interval stands by itself: one in"
        " twenty misses. Time: training of both.",
        (
            Column("hypothesis", "Hypothesis"),
            Column("change", "What was changed"),
            Column("expected", "Then it should be"),
            Column("verdict", "Verdict"),
            Column("model", "Model"),
            Column("metric", "Metric"),
            Column("before", "Before"),
            Column("before_sd", "sd"),
            Column("after", "After"),
            Column("after_sd", "sd"),
            Column("gain", "Gain"),
            Column("gain_low", "from"),
            Column("gain_high", "to"),
            Column("seconds", "Time", "s"),
            Column("of", "Rows of the paper"),
        ),
        tuple(trial.row() for trial in trials),
    )
