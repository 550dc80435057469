"""Numbers of two runs -> what changed, in units of its spread. Rows of metrics.csv in, values out.

A number is compared by its mean over folds, runs or draws. Its spread is the standard deviation of
the differences fold by fold where both runs have the same folds (*paired*), else the root of the
sum of both variances. What is beyond REACH standard deviations stands first; no test is made.
"""

from __future__ import annotations

import math
import re
import statistics
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from ajgdata.report.comparison import REACH
from ajgdata.report.format import Score

#: Numbers that differ by less than this share differ by rounding.
ROUNDING = 1e-9
LOWER_IS_BETTER = ("rmse", "mae", "calibration_error")
HIGHER_IS_BETTER = (
    "accuracy", "balanced_accuracy", "macro_f1", "r2", "rank_correlation", "precision",
    "silhouette", "sorted_before_error", "sorts_in_a_row",
)  # fmt: skip
#: Shown in per cent.
SHARES = ("accuracy", "balanced_accuracy", "macro_f1", "precision", "coverage", "share")
#: Parts in which a model has nothing to tell from, and what it should not tell: neither is better.
NEITHER_PARTS, NEITHER_ENDS = ("silent", "permutations"), ("of session_id", ", chance")
MEASURED = "measured"  #: statistic of times and memory
_NUMBERED = re.compile(r"(?!of )\w+ \d+")

Direction = Literal["better", "worse", ""]


class Key(NamedTuple):
    """What a number is of. The metric names the statistic, too, where it is no mean."""

    dataset: str
    task: str
    model: str
    part: str
    metric: str


@dataclass(frozen=True)
class Number:
    """One number of a run: mean and sd (NaN: none), and its values by fold, run or draw."""

    score: Score
    unit: str = ""
    source: str = ""
    seed: str = ""
    values: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Change:
    """One number in both runs. `difference` is B - A; `spread` is NaN where none is known."""

    key: Key
    a: Number
    b: Number
    difference: float
    spread: float
    paired: bool

    @property
    def ratio(self) -> float:
        """Return |difference| / spread: infinite if all folds differ alike, NaN if unknown."""
        if math.isnan(self.spread):
            return math.nan
        if self.spread == 0:
            return math.inf if self.difference else 0.0
        return abs(self.difference) / self.spread

    @property
    def beyond(self) -> bool:
        """Return whether the difference is beyond REACH standard deviations."""
        return self.ratio > REACH

    @property
    def relative(self) -> float:
        """Return |difference| over the larger of both numbers; 0 for two zeros."""
        size = max(abs(self.a.score.mean), abs(self.b.score.mean))
        return abs(self.difference) / size if size else 0.0

    @property
    def direction(self) -> Direction:
        """Return whether B is better or worse; neither for a metric that has no better."""
        sign = better_sign(self.key) * self.difference
        return "better" if sign > 0 else "worse" if sign < 0 else ""

    @property
    def scale(self) -> int:
        """Return what the number is multiplied by to be shown."""
        return 100 if is_share(self.key.metric) else 1

    @property
    def unit(self) -> str:
        """Return the unit in which the number is shown."""
        return "%" if is_share(self.key.metric) else self.b.unit


class CostChange(NamedTuple):
    """One cost in both runs; `ratio` is B / A."""

    key: Key
    a: float
    b: float
    ratio: float


@dataclass(frozen=True)
class Numbers:
    """The numbers of a run, and apart its costs, which belong to a machine."""

    scores: Mapping[Key, Number]
    costs: Mapping[Key, float]


@dataclass(frozen=True)
class Differences:
    """All numbers of two runs: what is equal, what changed (beyond its spread first, then without
    a known spread, then within), and what only one of them has."""

    equal: tuple[Change, ...]
    changed: tuple[Change, ...]
    only_a: tuple[Key, ...]
    only_b: tuple[Key, ...]
    costs: tuple[CostChange, ...]

    @property
    def compared(self) -> int:
        """Return how many numbers both runs have."""
        return len(self.equal) + len(self.changed)

    @property
    def beyond(self) -> tuple[Change, ...]:
        """Return the changes beyond their spread, the largest first."""
        return tuple(one for one in self.changed if one.beyond)

    @property
    def worse(self) -> tuple[Change, ...]:
        """Return the changes beyond their spread to the worse."""
        return tuple(one for one in self.beyond if one.direction == "worse")


def better_sign(key: Key) -> int:
    """Return 1 where higher is better, -1 where lower is, 0 where neither is."""
    if key.part.partition(":")[0] in NEITHER_PARTS or key.metric.endswith(NEITHER_ENDS):
        return 0
    name = _base(key.metric)
    return (name in HIGHER_IS_BETTER) - (name in LOWER_IS_BETTER)


def is_share(metric: str) -> bool:
    """Return whether a metric is shown in per cent."""
    return _base(metric) in SHARES


def _base(metric: str) -> str:
    """Return `accuracy` for `accuracy of object`, `precision` for `precision at 5`."""
    return re.split(r", | of | at ", metric, maxsplit=1)[0]


def numbers_of(rows: Iterable[Mapping[str, str]]) -> Numbers:
    """Return the numbers of the rows of a metrics.csv. Raises ValueError for a value that is no
    number, with the row."""
    grouped: dict[Key, dict[str, float]] = {}
    told: dict[Key, Mapping[str, str]] = {}
    costs: dict[Key, float] = {}
    for row in rows:
        if not row["value"]:
            continue  # undefined: as if it were not there
        key = Key(*(row[name] for name in Key._fields))
        try:
            value = float(row["value"])
        except ValueError:
            raise ValueError(f"{'/'.join(key)}: {row['value']!r} is not a number") from None
        if row["statistic"] == MEASURED:
            costs[key] = value
        else:
            grouped.setdefault(key, {})[row["statistic"]] = value
            told[key] = row
    scores = {}
    for key, found in grouped.items():
        about = {name: told[key][name] for name in ("unit", "source", "seed")}
        for name, score, values in _split(key.metric, found):
            scores[key._replace(metric=name)] = Number(score, values=values, **about)
    return Numbers(scores, costs)


def _split(
    metric: str, found: Mapping[str, float]
) -> Iterable[tuple[str, Score, Mapping[str, float]]]:
    """Yield the mean of a metric with its folds, and each statistic that stands for itself.

    `pooled` says what a mean says, and is left out beside one.
    """
    values = {name: value for name, value in found.items() if _NUMBERED.fullmatch(name)}
    mean = found.get("mean", statistics.fmean(values.values()) if values else math.nan)
    if not math.isnan(mean):
        yield metric, Score(mean, found.get("sd", _spread(values.values()))), values
    apart = {"mean", "sd", *values} | (set() if math.isnan(mean) else {"pooled"})
    for name, value in found.items():
        if name not in apart:
            yield f"{metric}, {name}", Score(value, math.nan), {}


def compare_numbers(a: Numbers, b: Numbers, same_folds: Callable[[Key], bool]) -> Differences:
    """Compare the numbers of two runs; `same_folds` tells whether the folds of a task hold the same
    recordings in both, as far as is known."""
    changed: list[Change] = []
    equal: list[Change] = []
    for key in a.scores.keys() & b.scores.keys():
        first, second = a.scores[key], b.scores[key]
        group = equal if _equal(first, second) else changed
        group.append(_change(key, first, second, same_folds(key)))
    costs = [
        CostChange(key, a.costs[key], b.costs[key], b.costs[key] / a.costs[key])
        for key in a.costs.keys() & b.costs.keys()
        if a.costs[key] > 0 and b.costs[key] > 0
    ]
    return Differences(
        tuple(sorted(equal, key=lambda one: one.key)),
        tuple(sorted(changed, key=_order)),
        tuple(sorted(a.scores.keys() - b.scores.keys())),
        tuple(sorted(b.scores.keys() - a.scores.keys())),
        tuple(sorted(costs, key=lambda one: (-abs(math.log(one.ratio)), one.key))),
    )


def _equal(a: Number, b: Number) -> bool:
    """Return whether nothing but rounding differs; numbers that only one has are no difference."""
    pairs = [(a.score.mean, b.score.mean)]
    pairs += [(a.values[name], b.values[name]) for name in a.values.keys() & b.values.keys()]
    return all(math.isclose(x, y, rel_tol=ROUNDING, abs_tol=1e-12) for x, y in pairs)


def _change(key: Key, a: Number, b: Number, same_folds: bool) -> Change:
    paired = (
        same_folds and len(a.values) > 1 and a.values.keys() == b.values.keys() and a.seed == b.seed
    )
    if paired:
        spread = _spread([_difference(a.values[name], b.values[name]) for name in a.values])
    else:
        spread = math.hypot(a.score.sd, b.score.sd)  # NaN if either is
    difference = _difference(a.score.mean, b.score.mean)
    # Folds that differ alike but for rounding.
    if spread <= ROUNDING * max(abs(a.score.mean), abs(b.score.mean)):
        spread = 0.0
    return Change(key, a, b, difference, spread, paired)


def _difference(before: float, after: float) -> float:
    """Return the change of a number; two equal infinities differ by 0."""
    return 0.0 if before == after else after - before


def _spread(values: Collection[float]) -> float:
    """Return the standard deviation; NaN for one number, or if a number is infinite."""
    is_defined = len(values) > 1 and all(map(math.isfinite, values))
    return statistics.stdev(values) if is_defined else math.nan


def _order(one: Change) -> tuple[int, float, float, Key]:
    """Beyond the spread, then without one, then within; the largest first."""
    if math.isnan(one.ratio):
        return 1, -one.relative, 0.0, one.key
    return (0 if one.beyond else 2), -one.ratio, -one.relative, one.key
