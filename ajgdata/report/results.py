"""How good a model is on a task, and at what cost: plain values and arrays, checked on creation.

Scores of classes are fractions (0..1), scores of regressions are in the target's unit, times in the
unit of their name.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ajgdata.report.format import Score, Source
from ajgdata.report.paper import PaperFigure
from ajgdata.types import Kind, Level

HEADLINE: dict[Kind, str] = {"regression": "rmse", "classification": "accuracy"}


@dataclass(frozen=True)
class Cost:
    """What a model cost: s to train all folds, ms to predict one recording alone, peak RSS."""

    train_s: float
    inference_ms_per_recording: float
    peak_memory_mb: float

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (math.isfinite(value) and value >= 0):
                raise ValueError(f"cost {name} is {value}: it must be finite and >= 0")


@dataclass(frozen=True, eq=False)
class Predictions:
    """Held-out predictions, n of each: numbers for a regression, class labels for classes."""

    y_true: np.ndarray
    y_pred: np.ndarray
    fold: np.ndarray
    classes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        shapes = {np.shape(self.y_true), np.shape(self.y_pred), np.shape(self.fold)}
        if len(shapes) != 1 or len(next(iter(shapes))) != 1 or next(iter(shapes)) == (0,):
            raise ValueError(f"y_true, y_pred and fold must be vectors of one length, not {shapes}")
        if self.classes:
            used = {str(label) for label in (*np.unique(self.y_true), *np.unique(self.y_pred))}
            if unknown := sorted(used - set(self.classes)):
                raise ValueError(f"labels {unknown} are not among the classes {self.classes}")
        elif not (np.isfinite(self.y_true).all() and np.isfinite(self.y_pred).all()):
            raise ValueError("y_true and y_pred of a regression must be finite")


@dataclass(frozen=True)
class PartResult:
    """The headline metric on a further part of a task; a chance of NaN is not told."""

    part: str  #: "unknown" (values never trained on) or "overall"
    score: Score
    paper: PaperFigure | None = None
    chance: float = math.nan


@dataclass(frozen=True)
class ElsewhereResult(PartResult):
    """The headline metric on recordings of another data set; `part` is its name."""

    title: str = ""
    level: Level | None = None


@dataclass(frozen=True)
class SilentResult:
    """What a model makes of recordings with the speaker silent, see `evaluate.shortcut_test`."""

    dataset: str
    title: str
    measure: str
    value: float
    null: float
    permutations: int
    p: float
    flagged: bool


@dataclass(frozen=True)
class ValueErrors:
    """Errors at one value of a regression target, see `evaluate.withheld.OneValue`."""

    value: float
    withheld: bool
    recordings: int
    rmse: float
    rmse_sd: float | None
    mae: float
    bias: float


@dataclass(frozen=True, eq=False)
class TaskResult:
    """One model on one task of one data set.

    `chance` is the headline metric of a predictor that ignores the sound. `random_split` is the
    headline metric when the split ignores `group_column`. `unseen` are the predictions of values
    that were withheld from training, each by every fold's model. Of a target with a `period` both
    are given at the repetition nearest to the truth.
    """

    dataset: str
    dataset_title: str
    task: str
    model: str
    model_label: str
    kind: Kind
    target: str
    unit: str
    source: Source
    metrics: Mapping[str, Score]
    chance: float
    n_recordings: int
    n_groups: int
    group_column: str
    folds: int
    cost: Cost
    predictions: Predictions
    random_split: Score | None = None
    paper: PaperFigure | None = None
    parts: tuple[PartResult, ...] = ()
    elsewhere: tuple[ElsewhereResult, ...] = ()
    level: Level | None = None
    silent: tuple[SilentResult, ...] = ()
    period: float | None = None
    unseen: Predictions | None = None
    values: tuple[ValueErrors, ...] = ()

    def __post_init__(self) -> None:
        if self.headline not in self.metrics:
            raise ValueError(f"{self.where}: a {self.kind} needs the metric {self.headline}")
        for score in (self.score, self.random_split or self.score):
            if not (math.isfinite(score.mean) and math.isfinite(score.sd)):
                raise ValueError(f"{self.where}: {self.headline} is {score.mean} ± {score.sd}")
        if self.kind == "regression" and not 0 < self.chance < math.inf:
            raise ValueError(f"{self.where}: chance RMSE is {self.chance}: is the target constant?")
        if self.kind == "classification" and not 0 <= self.chance < 1:
            raise ValueError(f"{self.where}: chance accuracy is {self.chance}: is there one class?")
        if self.kind == "classification" and not self.predictions.classes:
            raise ValueError(f"{self.where}: predictions of classes must list the classes")

    @property
    def where(self) -> str:
        """Data set, task and model, for messages."""
        return f"{self.dataset}/{self.task}/{self.model}"

    @property
    def headline(self) -> str:
        """Name of the headline metric: `rmse` or `accuracy`."""
        return HEADLINE[self.kind]

    @property
    def score(self) -> Score:
        """The headline metric."""
        return self.metrics[self.headline]

    def normalise(self, score: Score) -> Score:
        """A headline score as an error that tasks can share: 0 is perfect, 1 is chance.

        RMSE / chance RMSE, or (1 - accuracy) / (1 - chance accuracy).
        """
        if self.kind == "regression":
            scale, offset = 1 / self.chance, 0.0
        else:
            scale, offset = -1 / (1 - self.chance), 1 / (1 - self.chance)
        folds = tuple(offset + scale * value for value in score.per_fold)
        return Score(offset + scale * score.mean, abs(scale) * score.sd, folds)

    def levels(self) -> list[tuple[Level, Score]]:
        """Headline metric against the level of the data set tested on, in rising order."""
        tested = [(self.level, self.score), *((o.level, o.score) for o in self.elsewhere)]
        known = [(level, score) for level, score in tested if level is not None]
        return sorted(known, key=lambda one: one[0].value)

    @property
    def error(self) -> Score:
        """Normalised error of the grouped evaluation."""
        return self.normalise(self.score)


@dataclass(frozen=True)
class SkippedTask:
    """A task that could not be evaluated, and why."""

    dataset: str
    task: str
    model_label: str
    reason: str


def pareto_front(cost: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Which of n points no other point beats: boolean (n,).

    A point is beaten by another that is no worse in both and better in one; equals stay.
    """
    cost, error = np.asarray(cost, float), np.asarray(error, float)
    no_worse = (cost[:, None] <= cost) & (error[:, None] <= error)
    better = (cost[:, None] < cost) | (error[:, None] < error)
    return ~np.any(no_worse & better, axis=0)
