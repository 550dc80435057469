"""Verdicts on results: a number compared with a published number, or with a statement.

A number *agrees* only if its interval contains the published number and is narrow: less than a
quarter of the distance from chance to perfect. A wide interval contains almost any number, so it
is *inconclusive*. No spread can turn a difference into agreement.
"""

from __future__ import annotations

import math
from collections.abc import Collection
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
#: `disagrees` and `partly agrees` are for statements, of which neither better nor worse has a
#: meaning.
Verdict = Literal["agrees", "partly agrees", "better", "worse", "inconclusive", "disagrees"]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
#: Words at a result whose interval contains chance, or is worse.
NO_BETTER = "not better than chance"
#: Share of the distance from chance to perfect below which an interval is narrow.
NARROW = 0.25


def compare(
    value: float, interval: Interval, published: float, *, chance: float, perfect: float
) -> Verdict:
    """Return the verdict on our `value` and its 95 % interval; all in one unit.

    `chance` and `perfect` tell which direction is better. An interval that is undefined, as that
    of an error of zero, agrees only with the same number.

    >>> from ajgdata.evaluate.agreement import Interval, compare
    >>> compare(2.2, Interval(2.0, 2.7), 2.6, chance=8.2, perfect=0.0)  # RMSE in mm
    'agrees'
    >>> compare(2.2, Interval(0.4, 4.0), 2.6, chance=8.2, perfect=0.0)
    'inconclusive'
    """
    if not interval.is_defined:
        same = math.isclose(value, published, rel_tol=1e-9, abs_tol=1e-12)
        return "agrees" if same else "inconclusive"
    if interval.low <= published <= interval.high:
        narrow = interval.high - interval.low < NARROW * abs(chance - perfect)
        return "agrees" if narrow else "inconclusive"
    higher_is_better = perfect > chance
    return "better" if (interval.low > published) == higher_is_better else "worse"


def difference_interval(
    value: float, interval: Interval, published: float, published_interval: Interval
) -> Interval:
    """Return the 95 % interval of `value` - `published`, from the intervals of both.

    The distances of the ends are added as squares (method of variance estimates recovery: Zou &
    Donner 2008, Statistics in Medicine 27, 1693). For two shares this is the method of Newcombe.

    >>> from ajgdata.evaluate.agreement import Interval, difference_interval
    >>> difference_interval(0.9, Interval(0.87, 0.92), 0.5, Interval(0.46, 0.54))
    Interval(low=0.35, high=0.4447213595499958)
    """
    difference = value - published
    down = math.hypot(value - interval.low, published_interval.high - published)
    up = math.hypot(interval.high - value, published - published_interval.low)
    return Interval(difference - down, difference + up)


def compare_both(
    value: float,
    interval: Interval,
    published: float,
    published_interval: Interval,
    *,
    chance: float,
    perfect: float,
) -> Verdict:
    """Return the verdict on our `value` if the published value has an interval, too.

    The values differ if 0 is outside the interval of their difference. Otherwise they agree if
    this interval is narrow (see `compare`).
    """
    if not (interval.is_defined and published_interval.is_defined):
        return "inconclusive"
    gap = difference_interval(value, interval, published, published_interval)
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
