"""Verdicts on scores: compared with chance, a placebo, a published value, or a statement.

A score is an `Estimate`: a value with its 95 % interval, the score of a guess and the best possible
score. The difference of our value and the published value has a 95 % interval, which contains the
uncertainty of both. Our value *agrees* only if this interval contains 0 and is narrow: less than
a quarter of the distance from chance to perfect. A wide interval contains almost any number, so
the comparison is *inconclusive*.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from types import MappingProxyType
from typing import Literal, NamedTuple, get_args


class Interval(NamedTuple):
    """Ends of a 95 % interval; NaN if it is undefined."""

    low: float
    high: float

    @property
    def is_defined(self) -> bool:
        """Return whether both ends are known."""
        return not (math.isnan(self.low) or math.isnan(self.high))

    def scaled(self, factor: float) -> Interval:
        """Return the interval in a unit that is smaller by `factor` > 0."""
        return Interval(factor * self.low, factor * self.high)

    def shifted(self, distance: float) -> Interval:
        """Return the interval moved up by `distance`."""
        return Interval(self.low + distance, self.high + distance)


UNDEFINED = Interval(float("nan"), float("nan"))
#: Names of the ends of an interval over grasps in tables of scores.
GRASP_INTERVAL = ("grasp low", "grasp high")
PaperVerdict = Literal["agrees", "partly agrees", "better", "worse", "inconclusive", "disagrees"]
PAPER_VERDICTS: tuple[PaperVerdict, ...] = get_args(PaperVerdict)
#: Meaning of each verdict, in the report and in docs/variants.md.
VERDICT_MEANINGS: Mapping[PaperVerdict, str] = {
    "agrees": (
        "number: the 95 % interval of the difference contains 0 and is narrow; "
        "statement: the interval of each of its differences is above 0"
    ),
    "partly agrees": "statement: a part agrees, another part does not",
    "better": "number: the interval of the difference is on the better side of 0",
    "worse": "number: the interval of the difference is on the worse side of 0",
    "inconclusive": (
        "the interval contains 0 and is wide, or the verdict changes with the size of the "
        "published test or with the computer"
    ),
    "disagrees": "statement: the interval of its difference is below 0",
}
#: Remark on a result that is not distinguishable from chance, or is worse.
NO_BETTER = "not better than chance"
#: 97.5 % quantile of the standard normal distribution.
Z_95 = 1.959964
#: Share of the distance from chance to perfect below which an interval is narrow.
NARROW = 0.25


class Estimate(NamedTuple):
    """A score with its 95 % interval, the score of a guess, and the best possible score.

    All are in one unit, for example accuracies from 0 to 1, or errors in mm. `interval` can be
    undefined (NaN). `chance` is NaN if it is unknown.

    >>> import ajgdata
    >>> accuracy = ajgdata.Estimate(0.7, ajgdata.Interval(0.6, 0.8), chance=0.25, perfect=1.0)
    >>> accuracy.is_better_than_chance
    True
    """

    value: float
    interval: Interval
    chance: float
    perfect: float

    @property
    def is_better_than_chance(self) -> bool:
        """Return whether the interval is on the perfect side of chance.

        Without an interval, the value decides. True if chance is unknown.
        """
        if math.isnan(self.chance):
            return True
        return self.is_better_than(self.chance, self.interval.shifted(-self.chance))

    def higher_is_better(self, compared: float) -> bool:
        """Return whether higher values are better, which means that `perfect` is above chance.

        If chance is unknown, `perfect` must be above `value` or above the `compared` value.
        """
        worst = min(self.value, compared) if math.isnan(self.chance) else self.chance
        return self.perfect > worst

    def is_better_than(self, compared: float, gap: Interval) -> bool:
        """Return whether `gap`, the interval of value - `compared`, is on the perfect side of 0.

        If `gap` is undefined, the values are compared.
        """
        if not gap.is_defined:
            gap = Interval(self.value - compared, self.value - compared)
        return gap.low > 0 if self.higher_is_better(compared) else gap.high < 0

    def skill_factor(self, chance: float) -> float:
        """Return the factor of the distance to `perfect` for equal skill at another `chance`.

        The skill is (value - chance) / (perfect - chance): 0 for a guess, and 1 if every prediction
        is correct. The factor is 1 if a chance level is unknown (NaN).
        """
        if chance == self.chance or math.isnan(chance) or math.isnan(self.chance):
            return 1.0
        return (self.perfect - chance) / (self.perfect - self.chance)

    def at_chance(self, chance: float) -> Estimate:
        """Return the estimate of equal skill at another chance level.

        >>> from ajgdata.evaluate.agreement import Estimate, Interval
        >>> two_classes = Estimate(0.75, Interval(0.5, 1.0), chance=0.5, perfect=1.0)
        >>> two_classes.at_chance(0.25).value  # half of the way from chance to perfect
        0.625
        """
        factor = self.skill_factor(chance)
        if factor == 1:
            return self._replace(chance=chance)

        def converted(value: float) -> float:
            return self.perfect - factor * (self.perfect - value)

        interval = Interval(converted(self.interval.low), converted(self.interval.high))
        return Estimate(converted(self.value), interval, chance, self.perfect)


def wilson_interval(share: float, trials: int) -> Interval:
    """Return the 95 % score interval of a share (0 to 1) of `trials`.

    Source: Wilson 1927, J. Am. Stat. Assoc. 22, 209. It is the interval of a published accuracy
    if only its number of test recordings is known.

    >>> import ajgdata
    >>> low, high = ajgdata.wilson_interval(0.9, 40)
    >>> f"{low:.3f} {high:.3f}"
    '0.769 0.960'
    """
    squared = Z_95**2 / trials
    centre = share + squared / 2
    half_width = math.sqrt(squared * (share * (1 - share) + squared / 4))
    return Interval((centre - half_width) / (1 + squared), (centre + half_width) / (1 + squared))


def difference(
    value: float, interval: Interval, compared: float, compared_interval: Interval
) -> Interval:
    """Return the 95 % interval of `value` - `compared` from the intervals of both.

    Each end combines the distances from the two values to the ends of their intervals (Newcombe
    1998, Statistics in Medicine 17, method 10). The two values must be from different recordings.

    >>> from ajgdata.evaluate.agreement import Interval, difference
    >>> low, high = difference(0.8, Interval(0.77, 0.84), 0.5, Interval(0.47, 0.54))
    >>> f"{low:.2f} {high:.2f}"
    '0.25 0.35'
    """
    gap = value - compared
    below = math.hypot(value - interval.low, compared_interval.high - compared)
    above = math.hypot(interval.high - value, compared - compared_interval.low)
    return Interval(gap - below, gap + above)


def compare_with_published(
    score: Estimate, published: float, published_interval: Interval | None = None
) -> PaperVerdict:
    """Return the verdict on our score next to a published value, in the unit of the score.

    Without `published_interval`, the published value counts as exact. If the interval of the score
    is undefined, for example because the error is zero, only an equal published value agrees.

    >>> import ajgdata
    >>> rmse_mm = ajgdata.Estimate(2.2, ajgdata.Interval(2.0, 2.7), chance=8.2, perfect=0.0)
    >>> ajgdata.compare_with_published(rmse_mm, 2.6)
    'agrees'
    >>> wide = ajgdata.Estimate(2.2, ajgdata.Interval(0.4, 4.0), chance=8.2, perfect=0.0)
    >>> ajgdata.compare_with_published(wide, 2.6)
    'inconclusive'
    """
    if not score.interval.is_defined:
        same = math.isclose(score.value, published, rel_tol=1e-9, abs_tol=1e-12)
        return "agrees" if same else "inconclusive"
    gap = score.interval.shifted(-published)
    if published_interval is not None:
        gap = difference(score.value, score.interval, published, published_interval)
    if gap.low <= 0 <= gap.high:
        narrow = gap.high - gap.low < NARROW * abs(score.chance - score.perfect)
        return "agrees" if narrow else "inconclusive"
    is_higher = gap.low > 0
    return "better" if is_higher == score.higher_is_better(published) else "worse"


class PublishedJudgement(NamedTuple):
    """Verdict on a score next to a published value whose uncertainty is known in part.

    `by_trials` is the verdict for each number of trials; it is empty if the published value counts
    as exact. `is_stable` is true if the verdict is the same on all computers.
    """

    verdict: PaperVerdict
    by_trials: Mapping[int, PaperVerdict]
    is_stable: bool


def judge_published(
    score: Estimate,
    published: float,
    *,
    intervals: Mapping[int, Interval] = MappingProxyType({}),
    spread: float = 0.0,
) -> PublishedJudgement:
    """Compare a score with a published value for each number of trials and on other computers.

    `intervals` are the intervals of the published value by its number of trials. There are several
    if the publication does not state this number. Our value and its interval differ between
    computers by up to `spread`, in both directions. The verdict is inconclusive if it changes with
    the number of trials or with the computer. All values are in the unit of the score.

    >>> from ajgdata.evaluate.agreement import Estimate, Interval, judge_published, wilson_interval
    >>> accuracy = Estimate(0.8, Interval(0.77, 0.83), chance=0.25, perfect=1.0)
    >>> by_size = {trials: wilson_interval(0.9, trials) for trials in (40, 160)}
    >>> judgement = judge_published(accuracy, 0.9, intervals=by_size)
    >>> judgement.verdict, judgement.by_trials
    ('inconclusive', {40: 'inconclusive', 160: 'worse'})
    """
    if not intervals:
        verdict, is_stable = _verdict_on_computers(score, published, None, spread)
        return PublishedJudgement(verdict, {}, is_stable)
    by_trials: dict[int, PaperVerdict] = {}
    is_stable = True
    for trials, interval in intervals.items():
        by_trials[trials], is_same = _verdict_on_computers(score, published, interval, spread)
        is_stable = is_stable and is_same
    distinct = set(by_trials.values())
    verdict = distinct.pop() if len(distinct) == 1 else "inconclusive"
    return PublishedJudgement(verdict, by_trials, is_stable)


def _verdict_on_computers(
    score: Estimate, published: float, published_interval: Interval | None, spread: float
) -> tuple[PaperVerdict, bool]:
    """Return the verdict on a score, and whether it is the same on all computers."""
    verdicts: set[PaperVerdict] = set()
    for shift in (-spread, 0.0, spread):
        moved = score._replace(value=score.value + shift, interval=score.interval.shifted(shift))
        verdicts.add(compare_with_published(moved, published, published_interval))
    if len(verdicts) > 1:
        return "inconclusive", False
    return verdicts.pop(), True


def statement_verdict(gap: Interval) -> PaperVerdict:
    """Return the verdict on a statement that a difference is above 0, from its 95 % interval."""
    if not gap.is_defined:
        return "inconclusive"
    if gap.low > 0:
        return "agrees"
    if gap.high < 0:
        return "disagrees"
    return "inconclusive"


def joint_verdict(verdicts: Collection[PaperVerdict]) -> PaperVerdict:
    """Return one verdict on a statement about several objects, from the verdict on each."""
    distinct = set(verdicts)
    if len(distinct) == 1:
        return next(iter(distinct))
    if distinct & {"agrees", "partly agrees"}:
        return "partly agrees"
    return "disagrees" if "disagrees" in distinct else "inconclusive"


class PlaceboTest(NamedTuple):
    """Result of `placebo_test`.

    `placebo` is the score of the placebo at the chance level of the task. `gap` is the 95 %
    interval of score - placebo, in the unit of the scores; it is undefined if the interval of the
    score is. `is_better` is true if the score is better than chance and than the placebo.
    """

    score: Estimate
    placebo: Estimate
    gap: Interval
    is_better: bool


def placebo_test(score: Estimate, placebo: Estimate) -> PlaceboTest:
    """Test whether a score is better than that of one object under several class names.

    Both scores are of one metric, model and split. A placebo can have fewer names than the task
    has classes, so its score is converted to equal skill at the chance level of the task. The
    score is better if its interval is on the perfect side of chance, and the interval of the
    difference (see `difference`) is on the perfect side of 0. A placebo without an interval counts
    as exact. If the score has no interval, the values are compared.

    >>> import ajgdata
    >>> score = ajgdata.Estimate(0.8, ajgdata.Interval(0.72, 0.88), chance=0.25, perfect=1.0)
    >>> low = ajgdata.Estimate(0.3, ajgdata.Interval(0.2, 0.4), chance=0.25, perfect=1.0)
    >>> ajgdata.placebo_test(score, low).is_better
    True
    >>> high = ajgdata.Estimate(0.7, ajgdata.Interval(0.6, 0.8), chance=0.25, perfect=1.0)
    >>> ajgdata.placebo_test(score, high).is_better
    False
    """
    level = placebo.at_chance(score.chance)
    gap = UNDEFINED
    if score.interval.is_defined and level.interval.is_defined:
        gap = difference(score.value, score.interval, level.value, level.interval)
    elif score.interval.is_defined:
        gap = score.interval.shifted(-level.value)
    is_better = score.is_better_than_chance and score.is_better_than(level.value, gap)
    return PlaceboTest(score, level, gap, is_better)


#: End of the name of a condition whose scores count accepted decisions only.
ACCEPTED = "accepted"
#: Reasons why a score can be undefined, by the beginning of the name of its metric.
_REASONS = {
    "silhouette": "fewer than two labels among what is tested, or one for each recording",
    "distance": "no such pair of recordings",
    "r2": "all true values are the same",
}


def why_undefined(metric: str, statistic: str, condition: str = "") -> str:
    """Return the reason why a value in the table of results can be missing; "" if it cannot."""
    if condition.endswith(ACCEPTED) and metric == "accuracy":
        return "nothing was accepted"
    for beginning, reason in _REASONS.items():
        if metric.startswith(beginning):
            return reason
    if statistic in ("low", "high"):
        return "all folds have the same value: how far others would differ is not known"
    if statistic in GRASP_INTERVAL:
        return "too few grasps, or all resamples of grasps give the same value"
    if statistic == "sd":
        return "one value has no deviation"
    return ""
