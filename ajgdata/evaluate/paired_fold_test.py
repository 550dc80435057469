"""Tests of a change: folds of two cross-validations -> an interval, a p value and a verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import stdtr

from ajgdata.evaluate.intervals import ROUNDING
from ajgdata.evaluate.metrics import LOWER_IS_BETTER, RANGES
from ajgdata.evaluate.resampling import corrected_deviation, corrected_reach
from ajgdata.types import NotPossibleError

Expected = Literal["better", "worse"]
Verdict = Literal["supported", "refuted", "not supported", "not testable"]
LEVEL = 0.05  #: of significance, for all tests of a page together


@dataclass(frozen=True)
class FoldDifference:
    """By how much the second of two is better than the first, in the metric's unit: mean over
    folds, the ends of its 95 % interval, and the two-sided p value.

    Ends and p are NaN if all folds differ by the same amount: without a variance nothing can be
    tested.
    """

    gain: float
    low: float
    high: float
    p: float


def verdict(gain: float, p: float, expected: Expected = "better") -> Verdict:
    """Return the verdict on the hypothesis that the second is better (or worse).

    `p` is NaN without a test; correct it first (`holm`) if there are several tests. `refuted`: the
    opposite is significant.
    """
    if math.isnan(p):
        return "not testable"
    if p >= LEVEL:
        return "not supported"
    return "supported" if (gain > 0) == (expected == "better") else "refuted"


def holm(p: Sequence[float]) -> list[float]:
    """Return p values corrected for their number (Holm 1979, Scand. J. Statist. 6, 65).

    The chance that any true null hypothesis of the family is rejected at a level is at most that
    level. NaN, where nothing was tested, stays NaN and does not count.

    >>> from ajgdata.evaluate.paired_fold_test import holm
    >>> holm([0.04, 0.01, 0.03])
    [0.06, 0.03, 0.06]
    """
    values = np.asarray(p, float)
    order = np.argsort(values)  # NaN last
    tests = int(np.isfinite(values).sum())
    factor = np.arange(tests, 0, -1)
    corrected = np.full(len(values), np.nan)
    ranked = np.maximum.accumulate(values[order[:tests]] * factor)
    corrected[order[:tests]] = np.minimum(ranked, 1.0)
    return [float(value) for value in corrected]


def paired_fold_test(
    before: Sequence[float], after: Sequence[float], *, metric: str, paired: bool
) -> FoldDifference:
    """Compare fold values (k,) of a metric in two cross-validations with as many folds.

    `paired`: fold i of both tests the same groups. Folds share most of their training rows, so
    their plain standard error is too small. The variance of the mean difference of k folds is
    taken as (1/k + 1/(k-1)) s², its tests being 1/(k-1) of its training rows, with k-1 degrees of
    freedom (Nadeau & Bengio 2003, Machine Learning 52, 239). Unpaired, s² is the sum of both.

    The interval contains no gain that would take the mean of `before` beyond the range of the
    metric (`metrics.RANGES`): no share can rise above 1.

    Raises ValueError for other than two or more finite values of each, as many of both.
    """
    first, second = np.asarray(before, float), np.asarray(after, float)
    folds = len(first)
    if first.shape != second.shape or first.ndim != 1 or folds < 2:
        raise ValueError(f"need as many folds of both, two or more: {first.shape}, {second.shape}")
    if not (np.isfinite(first).all() and np.isfinite(second).all()):
        raise NotPossibleError("a fold has no value: give folds more groups")
    least, most = RANGES.get(metric, (-math.inf, math.inf))
    mean = float(first.mean())
    lower_is_better = metric in LOWER_IS_BETTER
    gains = first - second if lower_is_better else second - first
    variance = gains.var(ddof=1) if paired else first.var(ddof=1) + second.var(ddof=1)
    gain = float(gains.mean())
    if math.sqrt(variance) <= ROUNDING * max(np.abs(first).max(), np.abs(second).max()):
        return FoldDifference(gain, math.nan, math.nan, math.nan)
    reach = corrected_reach(float(variance), folds, 1 / (folds - 1))
    t = abs(gain) / corrected_deviation(float(variance), folds, 1 / (folds - 1))
    loss, room = (most - mean, mean - least) if lower_is_better else (mean - least, most - mean)
    p = float(2 * stdtr(folds - 1, -t))
    return FoldDifference(gain, max(gain - reach, -loss), min(gain + reach, room), p)
