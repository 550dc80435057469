"""Statistics of fold values: intervals of repeated fits, and tests of a change.

The training parts of folds share recordings, so the plain standard error over J folds, (s² / J)**½,
is too small. Nadeau & Bengio (2003, Machine Learning 52, 239) replace 1 / J by 1 / J + (number of
tested rows) / (number of training rows). Bouckaert & Frank (2004, PAKDD, 3) use this for repeated
cross-validation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from scipy.special import stdtr
from scipy.stats import t as student

from ajgdata.evaluate.agreement import UNDEFINED, Interval
from ajgdata.evaluate.crossval import Predictions
from ajgdata.evaluate.intervals import CONFIDENCE, RESAMPLES, ROUNDING
from ajgdata.evaluate.metrics import LOWER_IS_BETTER, RANGES, wrapped
from ajgdata.types import Kind, NotPossibleError


def corrected_deviation(variance: float, count: int, test_share: float) -> float:
    """Return the standard deviation of the mean of `count` fold values with a sample `variance`.

    `test_share` is the number of tested rows divided by the number of training rows: 1 / (k - 1)
    for k folds.
    """
    return math.sqrt((1 / count + test_share) * variance)


def corrected_reach(variance: float, count: int, test_share: float) -> float:
    """Return half the width of the 95 % interval of the mean (see `corrected_deviation`).

    The quantile is that of Student's t for `count` - 1 degrees of freedom.
    """
    deviations = float(student.ppf((1 + CONFIDENCE) / 2, count - 1))
    return deviations * corrected_deviation(variance, count, test_share)


def corrected_interval(values: Sequence[float], folds: int, metric: str = "") -> Interval:
    """Return the 95 % interval of the mean of fold values (repeats * folds,) of a metric.

    The interval is cut to the range of the metric, for example 0 to 1 for a share. It is undefined
    if a fold has no value, or if all folds have the same value, because the deviation of other
    folds is then unknown.

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
    lower, upper = RANGES.get(metric, (-math.inf, math.inf))
    mean = float(scores.mean())
    return Interval(max(mean - reach, lower), min(mean + reach, upper))


def repeat_seed(seed: int, repeat: int) -> int:
    """Return the seed of a repeat (from 0). The first repeat has the `seed` of the task."""
    if repeat == 0:
        return seed
    return int(np.random.SeedSequence([seed, repeat]).generate_state(1)[0])


def grasp_errors(
    predictions: Predictions, groups: np.ndarray, period: float | None = None
) -> np.ndarray:
    """Return the mean squared error (grasps,) of each grasp, in the order of the grasps' names.

    The error of a class is 1 if it is wrong, otherwise 0. `groups` (n,) are the grasps of the rows
    of the input. The error of a grasp is the mean over all its predictions. Raises ValueError for a
    grasp without predictions.

    >>> import numpy as np
    >>> from ajgdata.evaluate.crossval import Predictions
    >>> true, predicted = np.zeros(3), np.array([1.0, 3.0, 2.0])
    >>> held_out = Predictions(np.arange(3), np.zeros(3, int), true, predicted, None)
    >>> grasp_errors(held_out, np.array(["a", "a", "b"]))
    array([5., 4.])
    """
    if predictions.y_true.dtype.kind in "US":
        errors = (predictions.y_pred != predictions.y_true).astype(float)
    else:
        errors = np.square(wrapped(predictions.y_pred - predictions.y_true, period))
    member = np.unique(groups, return_inverse=True)[1][predictions.row]
    count = np.bincount(member)
    if not count.all() or len(count) < len(np.unique(groups)):
        raise ValueError("a grasp was predicted by no fold")
    return np.bincount(member, errors) / count


class RobustScore(NamedTuple):
    """RMSE over repeated fits, in the unit of the target, or accuracy.

    `per_fit` (fits,) are the values of the fits, each over all grasps, and `median` is their
    median. `low` and `high` are the ends of its 95 % bootstrap interval; each resample draws grasps
    and fits.
    """

    median: float
    low: float
    high: float
    per_fit: np.ndarray


def robust_score(errors: np.ndarray, kind: Kind = "regression", seed: int = 0) -> RobustScore:
    """Return the RMSE, or accuracy, over fits from the errors (fits, grasps) of `grasp_errors`.

    >>> import numpy as np
    >>> robust_score(np.full((3, 20), 4.0))[:3]
    (2.0, 2.0, 2.0)
    >>> robust_score(np.full((3, 20), 0.25), "classification").median
    0.75
    """

    def score(mean: np.ndarray) -> np.ndarray:
        return np.sqrt(mean) if kind == "regression" else 1 - mean

    fits, grasps = errors.shape
    generator = np.random.default_rng(seed)
    medians = np.empty(RESAMPLES)
    for n in range(RESAMPLES):
        drawn = np.bincount(generator.integers(grasps, size=grasps), minlength=grasps)
        scores = score(errors @ drawn / grasps)
        medians[n] = np.median(scores[generator.integers(fits, size=fits)])
    tail = 100 * (1 - CONFIDENCE) / 2
    low, high = np.percentile(medians, (tail, 100 - tail))
    per_fit = score(errors.mean(axis=1))
    return RobustScore(float(np.median(per_fit)), float(low), float(high), per_fit)


Expected = Literal["better", "worse"]
HypothesisVerdict = Literal["supported", "refuted", "not supported", "not testable"]
#: Level of significance, for all tests of a page together.
SIGNIFICANCE_LEVEL = 0.05


def verdict(gain: float, p: float, expected: Expected = "better") -> HypothesisVerdict:
    """Return the verdict on the hypothesis that a change makes a score better (or worse).

    `gain` is above 0 if the score is better after the change. `p` is NaN without a test; correct
    it first (`holm`) if there are several tests. The hypothesis is refuted if the opposite is
    significant.
    """
    if math.isnan(p):
        return "not testable"
    if p >= SIGNIFICANCE_LEVEL:
        return "not supported"
    is_as_expected = gain > 0 if expected == "better" else gain <= 0
    return "supported" if is_as_expected else "refuted"


def holm(p: Sequence[float]) -> list[float]:
    """Return p values corrected for their number (Holm 1979, Scand. J. Statist. 6, 65).

    The probability that a true null hypothesis of the family is rejected at a level is then no
    larger than this level. A NaN (no test) stays NaN and does not count.

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


@dataclass(frozen=True)
class FoldDifference:
    """Gain of a change in the unit of the metric, its 95 % interval, and its two-sided p value.

    The gain is the mean over folds; it is positive if the score is better after the change. `low`,
    `high` and `p` are NaN if all folds have the same gain, because the variance is then unknown.
    """

    gain: float
    low: float
    high: float
    p: float


def paired_fold_test(
    before: Sequence[float], after: Sequence[float], *, metric: str, paired: bool
) -> FoldDifference:
    """Compare fold values (k,) of a metric in two cross-validations with k folds each.

    `paired` is true if fold i tests the same groups in both. The variance of the mean gain is
    (1/k + 1/(k-1)) s², because a test part has 1/(k-1) of the rows of its training part. There are
    k-1 degrees of freedom (Nadeau & Bengio, see the head of this module). s² is the sample variance
    of the gains of the folds, or, without pairs, the sum of the variances of `before` and `after`.

    The interval is cut to the range of the metric (`metrics.RANGES`): for example, no gain takes
    an accuracy above 1.

    Raises ValueError unless both have the same number of values, two or more, and all are finite.
    """
    first = np.asarray(before, float)
    second = np.asarray(after, float)
    folds = len(first)
    if first.shape != second.shape or first.ndim != 1 or folds < 2:
        raise ValueError(f"need as many folds of both, two or more: {first.shape}, {second.shape}")
    if not (np.isfinite(first).all() and np.isfinite(second).all()):
        raise NotPossibleError("a fold has no value: give folds more groups")
    lower_is_better = metric in LOWER_IS_BETTER
    gains = first - second if lower_is_better else second - first
    gain = float(gains.mean())
    variance = float(gains.var(ddof=1) if paired else first.var(ddof=1) + second.var(ddof=1))
    if math.sqrt(variance) <= ROUNDING * max(np.abs(first).max(), np.abs(second).max()):
        return FoldDifference(gain, math.nan, math.nan, math.nan)
    test_share = 1 / (folds - 1)
    t = abs(gain) / corrected_deviation(variance, folds, test_share)
    p = float(2 * stdtr(folds - 1, -t))
    mean = float(first.mean())
    lower, upper = RANGES.get(metric, (-math.inf, math.inf))
    largest_loss = upper - mean if lower_is_better else mean - lower
    largest_gain = mean - lower if lower_is_better else upper - mean
    reach = corrected_reach(variance, folds, test_share)
    low = max(gain - reach, -largest_loss)
    high = min(gain + reach, largest_gain)
    return FoldDifference(gain, low, high, p)
