"""Errors, cost and predictions of cross-validation, read back from its tables."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ajgdata.evaluate.agreement import (
    GRASP_INTERVAL,
    Interval,
    Verdict,
    compare,
    is_better_than_chance,
)
from ajgdata.experiments.base import SCORES, Result, TaskResults
from ajgdata.report import comparison
from ajgdata.report.format import Score, mean_sd, words
from ajgdata.report.paper import PaperFigure
from ajgdata.types import Level

GROUPED, RANDOM = "grouped", "random"
WITHHELD = "withheld"  #: part of the recordings that no fold trains on
OVERALL = "overall"  #: known and withheld recordings together
#: Metrics of the part "training of SPLIT": recordings that a model learned from, and had.
TRAINED_ON = ("trained_on", "available")
#: The paper's name for what is told of these parts.
PAPER_PARTS = {
    GROUPED: "known", RANDOM: "known_by_recording", WITHHELD: "unknown", OVERALL: "overall",
}  # fmt: skip
#: The paper's own model, where a task has it.
PAPER_MODEL = "cnn"
#: The paper's figure on a task of many models: its number is that of k-NN.
BASELINES = "baselines"


def elsewhere(dataset: str) -> str:
    """Return the part of the results that is of another data set."""
    return f"on:{dataset}"


class ModelCost(NamedTuple):
    """Cost of a model: s to train all folds, ms to predict one recording alone, peak RSS."""

    train_s: float
    inference_ms_per_recording: float
    peak_memory_mb: float

    @property
    def inference_s(self) -> float:
        """Time (s) to predict one recording alone."""
        return self.inference_ms_per_recording / 1e3


class Predictions(NamedTuple):
    """Held-out predictions, n of each: numbers of a regression, labels (str) of classes."""

    y_true: np.ndarray
    y_pred: np.ndarray


@dataclass(frozen=True, eq=False)
class ModelResult:
    """One model on one task."""

    task: TaskResults
    result: Result

    @property
    def label(self) -> str:
        """Return the model's name for people."""
        return self.result.label

    @cached_property
    def _scores(self) -> Mapping[tuple[str, str], Mapping[str, float]]:
        """Return values by statistic, for each part and metric; a missing one is NaN."""
        found: dict[tuple[str, str], dict[str, float]] = {}
        table = self.result.tables[SCORES]
        for row, value in zip(table.rows, table.numbers("value"), strict=True):
            one = found.setdefault((str(row["part"]), str(row["metric"])), {})
            one[str(row["statistic"])] = float(value)
        return found

    def has(self, part: str) -> bool:
        """Return whether a part was evaluated."""
        return (part, self.task.metric) in self._scores

    def score(self, part: str = "", metric: str = "") -> Score:
        """Return a metric of a part; by default the first metric of the grouped split.

        Raises ValueError for a part, or a metric, that was not evaluated.
        """
        part, name = part or GROUPED, metric or self.task.metric
        if (part, name) not in self._scores:
            raise ValueError(f"{self.task.title}: no {name} of {part!r} by {self.label}")
        values = self._scores[part, name]
        folds = tuple(v for statistic, v in values.items() if statistic.startswith("fold "))
        return Score(values["mean"], values["sd"], folds)

    @property
    def thinned(self) -> str:
        """Return on how many recordings of a fold it was trained, of how many; "" if on all."""
        counts = [self._scores.get((f"training of {GROUPED}", name)) for name in TRAINED_ON]
        return " of ".join(f"{round(one['mean']):,}" for one in counts if one)

    def chance(self, part: str = "") -> float:
        """Return the metric that is read first of a guess that ignores the sound; NaN if untold."""
        return self._scores[part or GROUPED, self.task.metric].get("chance", math.nan)

    def interval(self, part: str = "") -> Interval:
        """Return the 95 % interval over grasps of the metric that is read first."""
        values = self._scores[part or GROUPED, self.task.metric]
        return Interval(*(values.get(end, math.nan) for end in GRASP_INTERVAL))

    def with_interval(self, part: str = "") -> Score:
        """Return the metric that is read first with its interval over grasps, if it is known."""
        score, interval = self.score(part), self.interval(part)
        return score._replace(low=interval.low, high=interval.high)

    @property
    def perfect(self) -> float:
        """Return the best possible value of the metric that is read first."""
        return 0.0 if self.task.kind == "regression" else 1.0

    def verdict(self, part: str, published: float) -> Verdict:
        """Return how the result on a part compares with a published value, given as shown."""
        return compare(
            self.score(part).mean, self.interval(part), published / self.task.scale,
            chance=self.chance(part), perfect=self.perfect,
        )  # fmt: skip

    def beats_chance(self, part: str = "") -> bool:
        """Return whether the interval over grasps is better than chance."""
        mean, interval = self.score(part).mean, self.interval(part)
        return is_better_than_chance(mean, interval, self.chance(part), self.perfect)

    def normalise(self, score: Score) -> Score:
        """Return a score as an error that tasks can share: 0 is perfect, 1 is chance.

        RMSE / chance RMSE, or (1 - accuracy) / (1 - chance accuracy).
        """
        if self.task.kind == "regression":
            scale, offset = 1 / self.chance(), 0.0
        else:
            scale, offset = -1 / (1 - self.chance()), 1 / (1 - self.chance())
        folds = tuple(offset + scale * value for value in score.per_fold)
        ends = sorted(offset + scale * end for end in (score.low, score.high))
        return Score(offset + scale * score.mean, abs(scale) * score.sd, folds, *ends)

    @property
    def error(self) -> Score:
        """Return the normalised error of the grouped split."""
        return self.normalise(self.score())

    @cached_property
    def cost(self) -> ModelCost:
        """Return what training and predicting cost on the grouped split."""
        rows = self.result.cost[SCORES].where(part=f"cost of {GROUPED}").rows
        measured = {str(row["metric"]): float(row["value"] or 0) for row in rows}
        return ModelCost(measured["train_s"], 1e3 * measured["latency_s"], measured["peak_rss_mb"])

    def count(self, what: str, part: str = GROUPED) -> int:
        """Return the number of `recordings`, `groups` or `folds` of a part."""
        return int(self.result.about["parts"][part][what])

    @property
    def classes(self) -> tuple[str, ...]:
        """Return the classes, none of a regression."""
        return tuple(map(str, self.result.about["classes"]))

    def predictions(self, part: str = GROUPED) -> Predictions:
        """Return what was predicted of a part.

        Of a target with a period predictions are given at the repetition nearest to the truth:
        means and axes then make sense.
        """
        from ajgdata.evaluate.metrics import wrapped

        table = self.result.tables["predictions"].where(split=part)
        if self.task.kind == "classification":
            labels = (np.asarray(table.column(key), np.str_) for key in ("y_true", "y_pred"))
            return Predictions(*labels)
        true, predicted = table.numbers("y_true"), table.numbers("y_pred")
        if self.task.period_deg:
            predicted = true + wrapped(predicted - true, self.task.period_deg)
        return Predictions(true, predicted)

    def levels(self) -> list[tuple[Level, Score]]:
        """Return the score at each level that was tested, in rising order."""
        tested = [(self.task.level, self.score())]
        for name in self.task.settings.test_on:
            tested.append((self.task.others[name].level, self.score(elsewhere(name))))
        known = [(level, score) for level, score in tested if level is not None]
        return sorted(known, key=lambda one: one[0].value)

    @property
    def parts(self) -> list[tuple[str, PaperFigure | None]]:
        """Return the parts that were tested, the grouped split first, with the paper's figures."""
        named = [(part, self.task.papers.get(p)) for part, p in PAPER_PARTS.items()]
        named += [
            (elsewhere(name), self.task.papers.get(name)) for name in self.task.settings.test_on
        ]
        return [(part, paper) for part, paper in named if self.has(part)]

    def shown(self, score: Score | None = None) -> str:
        """Return the score that is read first, or another in the same terms, with its unit."""
        one = self.score() if score is None else score
        return mean_sd(one, self.task.shown_unit, self.task.scale)

    @property
    def shown_chance(self) -> str:
        """Return the score of a guess that ignores the sound, with its unit."""
        return self.shown(Score(self.chance(), 0.0))


def part_label(results: TaskResults, part: str) -> str:
    """Return what a further part of a task is."""
    told = {
        WITHHELD: "values withheld from training",
        OVERALL: "known and withheld values together",
    }
    told |= {RANDOM: "split by recording: other recordings of a grasp may be trained on"}
    tested = {elsewhere(name): f"tested on {o.title}" for name, o in results.others.items()}
    return (told | tested)[part]


def models_of(results: TaskResults) -> tuple[ModelResult, ...]:
    """Return the models of a task in the order in which it names them."""
    return tuple(ModelResult(results, result) for result in results.results)


def best_of(models: tuple[ModelResult, ...]) -> ModelResult:
    """Return the model of lowest error; of equals, the first."""
    return min(models, key=lambda model: model.error.mean)


def close_to_best(models: tuple[ModelResult, ...]) -> list[ModelResult]:
    """Return the best model, and those whose error is within its standard deviation of it."""
    top = best_of(models).error
    return [m for m in models if m.error.mean <= top.mean + max(top.sd, 0)]


def paper_told(model: ModelResult, part: str = GROUPED) -> tuple[float, str] | None:
    """Return the number that the paper gives for a part of the task, and whose it is, or None."""
    paper = dict(model.parts).get(part)
    if paper is None or paper.value is None:
        return None
    return paper.value, f"the paper's {'k-NN' if paper.id == BASELINES else 'CNN'}"


def training_cost(results: TaskResults, label: str) -> comparison.Cost | None:
    """Return what the model of that name for people cost, if the task has it."""
    found = (model for model in models_of(results) if model.label == label)
    return next((comparison.Cost(*model.cost[:2]) for model in found), None)


def quantity(results: TaskResults) -> str:
    """Return the target without the unit in its name: `edge_mm` -> `edge`."""
    suffix = "deg" if results.unit == "°" else results.unit
    return words(results.target.removesuffix(f"_{suffix}"))
