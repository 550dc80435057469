"""Verdicts on results: a number compared with a published number, or with a statement.

The difference of our number and the published number has a 95 % interval, which contains the
uncertainty of both. Our number *agrees* only if this interval contains 0 and is narrow: less than
a quarter of the distance from chance to perfect. A wide interval contains almost any number, so
the comparison is *inconclusive*.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
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
#: Names of both ends in tables of scores.
GRASP_INTERVAL = ("grasp low", "grasp high")
Verdict = Literal["agrees", "partly agrees", "better", "worse", "inconclusive", "disagrees"]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
#: Meaning of each verdict, in the report and in docs/ablations.md.
VERDICT_MEANINGS: Mapping[Verdict, str] = {
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
#: Words at a result whose interval contains chance, or is worse.
NO_BETTER = "not better than chance"
#: 97.5 % quantile of the standard normal distribution.
Z_95 = 1.959964
#: Share of the distance from chance to perfect below which an interval is narrow.
NARROW = 0.25


def wilson(share: float, trials: int) -> Interval:
    """Return the 95 % score interval of a share (0 to 1) of `trials` (Wilson 1927).

    >>> from ajgdata.evaluate.agreement import wilson
    >>> low, high = wilson(0.9, 40)
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
    1998, Statistics in Medicine 17, method 10). The two values are from different recordings.

    >>> from ajgdata.evaluate.agreement import Interval, difference
    >>> low, high = difference(0.8, Interval(0.77, 0.84), 0.5, Interval(0.47, 0.54))
    >>> f"{low:.2f} {high:.2f}"
    '0.25 0.35'
    """
    gap = value - compared
    below = math.hypot(value - interval.low, compared_interval.high - compared)
    above = math.hypot(interval.high - value, compared - compared_interval.low)
    return Interval(gap - below, gap + above)


def compare(
    value: float,
    interval: Interval,
    published: float,
    *,
    chance: float,
    perfect: float,
    published_interval: Interval | None = None,
) -> Verdict:
    """Return the verdict on our `value` and its 95 % interval; all in one unit.

    `chance` and `perfect` show which direction is better. Without `published_interval`, the
    published value counts as exact. If `interval` is undefined, as that of an error of zero, our
    value agrees only with the same number.

    >>> from ajgdata.evaluate.agreement import Interval, compare
    >>> compare(2.2, Interval(2.0, 2.7), 2.6, chance=8.2, perfect=0.0)  # RMSE in mm
    'agrees'
    >>> compare(2.2, Interval(0.4, 4.0), 2.6, chance=8.2, perfect=0.0)
    'inconclusive'
    """
    if not interval.is_defined:
        same = math.isclose(value, published, rel_tol=1e-9, abs_tol=1e-12)
        return "agrees" if same else "inconclusive"
    gap = interval.shifted(-published)
    if published_interval is not None:
        gap = difference(value, interval, published, published_interval)
    if gap.low <= 0 <= gap.high:
        narrow = gap.high - gap.low < NARROW * abs(chance - perfect)
        return "agrees" if narrow else "inconclusive"
    higher_is_better = perfect > chance
    return "better" if (gap.low > 0) == higher_is_better else "worse"


def statement(gap: Interval) -> Verdict:
    """Return the verdict on a statement that holds if a difference is above 0."""
    if not gap.is_defined:
        return "inconclusive"
    if gap.low > 0:
        return "agrees"
    return "disagrees" if gap.high < 0 else "inconclusive"


def together(verdicts: Collection[Verdict]) -> Verdict:
    """Return one verdict on a statement about several objects, from the verdict on each."""
    distinct = set(verdicts)
    if len(distinct) == 1:
        return next(iter(distinct))
    if distinct & {"agrees", "partly agrees"}:
        return "partly agrees"
    return "disagrees" if "disagrees" in distinct else "inconclusive"


def is_better_than_chance(value: float, interval: Interval, chance: float, perfect: float) -> bool:
    """Return whether the interval (the value without an interval) is on the perfect side of chance.

    True if chance is unknown.
    """
    low, high = interval if interval.is_defined else (value, value)
    if math.isnan(chance):
        return True
    return low > chance if perfect > chance else high < chance


def is_better_than_placebo(
    value: float, interval: Interval, placebo: float, placebo_interval: Interval, perfect: float
) -> bool:
    """Return whether the difference to the placebo is on the perfect side of 0.

    Both have an interval. Without an interval of the placebo, its value counts as exact.
    """
    if not (interval.is_defined and placebo_interval.is_defined):
        return is_better_than_chance(value, interval, placebo, perfect)
    gap = difference(value, interval, placebo, placebo_interval)
    return gap.low > 0 if perfect > placebo else gap.high < 0


#: Condition of scores of accepted decisions ends with this.
ACCEPTED = "accepted"
#: Why scores can be undefined, by the beginning of their metric.
_REASONS = {
    "silhouette": "fewer than two labels among what is tested, or one for each recording",
    "distance": "no such pair of recordings",
    "r2": "all true values are the same",
}


def why_undefined(metric: str, statistic: str, condition: str = "") -> str:
    """Return why a number of the table of results may be missing, "" if it never may."""
    if condition.endswith(ACCEPTED) and metric == "accuracy":
        return "nothing was accepted"
    for beginning, reason in _REASONS.items():
        if metric.startswith(beginning):
            return reason
    if statistic in ("low", "high"):
        return "all folds have the same value: how far others would differ is not known"
    if statistic in GRASP_INTERVAL:
        return "too few grasps, or all resamples of grasps give the same value"
    return "one value has no deviation" if statistic == "sd" else ""
