"""Statistics of fold values: intervals of repeated fits, and tests of a change.

Repeated splits share recordings, so the plain standard error over all folds is too small. Nadeau &
Bengio (2003, Machine Learning 52, 239) add the share of tested to trained rows to 1/J; Bouckaert &
Frank (2004, PAKDD, 3) use it for repeated cross-validation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from scipy.special import stdtr
from scipy.stats import t as student

from ajgdata.evaluate import metrics
from ajgdata.evaluate.agreement import UNDEFINED, Interval
from ajgdata.evaluate.crossval import Predictions
from ajgdata.evaluate.intervals import CONFIDENCE, RESAMPLES, ROUNDING
from ajgdata.evaluate.metrics import LOWER_IS_BETTER, RANGES, wrapped
from ajgdata.types import NotPossibleError


def corrected_deviation(variance: float, count: int, test_share: float) -> float:
    """Return the standard deviation of the mean of `count` fold values of that sample variance.

    `test_share` is the number of tested rows over that of trained ones: 1/(k-1) of k folds.
    """
    return math.sqrt((1 / count + test_share) * variance)


def corrected_reach(variance: float, count: int, test_share: float) -> float:
    """Return half the width of the corrected 95 % interval, t of `count` - 1 degrees of freedom."""
    deviations = float(student.ppf((1 + CONFIDENCE) / 2, count - 1))
    return deviations * corrected_deviation(variance, count, test_share)


def corrected_interval(values: Sequence[float], folds: int, metric: str = "") -> Interval:
    """Return the interval of the mean of fold values (repeats * folds,) of a metric.

    It ends at the range of the metric: no share is above 1 or below 0, no error below 0. It is
    undefined if a fold has no value, or if all folds have the same: no deviation is then known.

    >>> from ajgdata.evaluate.fold_tests import corrected_interval
    >>> low, high = corrected_interval([1.0, 2.0, 3.0, 4.0, 5.0], folds=5)
    >>> f"{low:.3f} {high:.3f}"  # 3 ± 2.776 sqrt((1/5 + 1/4) 2.5)
    '0.055 5.945'
    """
    scores = np.asarray(values, float)
    if len(scores) < 2 or not np.isfinite(scores).all():
        return UNDEFINED
    if np.ptp(scores) <= ROUNDING * np.abs(scores).max():
        return UNDEFINED
    reach = corrected_reach(float(scores.var(ddof=1)), len(scores), 1 / (folds - 1))
    lower, upper = metrics.RANGES.get(metric, (-math.inf, math.inf))
    mean = float(scores.mean())
    return Interval(max(mean - reach, lower), min(mean + reach, upper))


def repeat_seed(seed: int, repeat: int) -> int:
    """Return the seed of a repeat: that of the task for the first."""
    return int(np.random.SeedSequence([seed, repeat]).generate_state(1)[0]) if repeat else seed


class RobustError(NamedTuple):
    """RMSE over repeated fits, in the unit of the target.

    `median` is over fits, of the RMSE over all grasps; `low` and `high` are the ends of its 95 %
    bootstrap interval, for which grasps and fits are drawn together. `per_fit` (fits,) are the
    values of the fits.
    """

    median: float
    low: float
    high: float
    per_fit: np.ndarray


def grasp_errors(
    predictions: Predictions, groups: np.ndarray, period: float | None = None
) -> np.ndarray:
    """Return the mean squared error (grasps,) of each grasp, in the order of their names.

    `groups` (n,) are the grasps of the rows that `predictions` are of. Recordings of a grasp, such
    as several draws of the noise, count together.

    >>> import numpy as np
    >>> from ajgdata.evaluate.crossval import Predictions
    >>> true, predicted = np.zeros(3), np.array([1.0, 3.0, 2.0])
    >>> held_out = Predictions(np.arange(3), np.zeros(3, int), true, predicted, None)
    >>> grasp_errors(held_out, np.array(["a", "a", "b"]))
    array([5., 4.])
    """
    squared = np.square(wrapped(predictions.y_pred - predictions.y_true, period))
    member = np.unique(groups, return_inverse=True)[1][predictions.row]
    count = np.bincount(member)
    if not count.all() or len(count) < len(np.unique(groups)):
        raise ValueError("a grasp was predicted by no fold")
    return np.bincount(member, squared) / count


def robust_error(squared: np.ndarray, seed: int = 0) -> RobustError:
    """Return the error over fits of mean squared errors (fits, grasps).

    >>> import numpy as np
    >>> robust_error(np.full((3, 20), 4.0))[:3]
    (2.0, 2.0, 2.0)
    """
    fits, grasps = squared.shape
    generator = np.random.default_rng(seed)
    medians = np.empty(RESAMPLES)
    for n in range(RESAMPLES):
        drawn = np.bincount(generator.integers(grasps, size=grasps), minlength=grasps)
        rmse = np.sqrt(squared @ drawn / grasps)
        medians[n] = np.median(rmse[generator.integers(fits, size=fits)])
    tail = 100 * (1 - CONFIDENCE) / 2
    low, high = np.percentile(medians, (tail, 100 - tail))
    per_fit = np.sqrt(squared.mean(axis=1))
    return RobustError(float(np.median(per_fit)), float(low), float(high), per_fit)


Expected = Literal["better", "worse"]
HypothesisVerdict = Literal["supported", "refuted", "not supported", "not testable"]
SIGNIFICANCE_LEVEL = 0.05  #: of significance, for all tests of a page together


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


def verdict(gain: float, p: float, expected: Expected = "better") -> HypothesisVerdict:
    """Return the verdict on the hypothesis that the second is better (or worse).

    `p` is NaN without a test; correct it first (`holm`) if there are several tests. `refuted`: the
    opposite is significant.
    """
    if math.isnan(p):
        return "not testable"
    if p >= SIGNIFICANCE_LEVEL:
        return "not supported"
    return "supported" if (gain > 0) == (expected == "better") else "refuted"


def holm(p: Sequence[float]) -> list[float]:
    """Return p values corrected for their number (Holm 1979, Scand. J. Statist. 6, 65).

    The chance that any true null hypothesis of the family is rejected at a level is at most that
    level. NaN, where nothing was tested, stays NaN and does not count.

    >>> from ajgdata.evaluate.fold_tests import holm
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
    lower, upper = RANGES.get(metric, (-math.inf, math.inf))
    mean = float(first.mean())
    lower_is_better = metric in LOWER_IS_BETTER
    gains = first - second if lower_is_better else second - first
    variance = gains.var(ddof=1) if paired else first.var(ddof=1) + second.var(ddof=1)
    gain = float(gains.mean())
    if math.sqrt(variance) <= ROUNDING * max(np.abs(first).max(), np.abs(second).max()):
        return FoldDifference(gain, math.nan, math.nan, math.nan)
    reach = corrected_reach(float(variance), folds, 1 / (folds - 1))
    t = abs(gain) / corrected_deviation(float(variance), folds, 1 / (folds - 1))
    loss, room = (upper - mean, mean - lower) if lower_is_better else (mean - lower, upper - mean)
    p = float(2 * stdtr(folds - 1, -t))
    return FoldDifference(gain, max(gain - reach, -loss), min(gain + reach, room), p)
