"""Intervals of repeated fits and of overlapping folds.

One split of few recordings says as much of the split as of the model. Repeats of it agree with each
other more than new recordings would, since they share them: the plain standard error over all folds
is far too small. Nadeau & Bengio (2003, Machine Learning 52, 239) add the share of tested to
trained rows to 1/J; Bouckaert & Frank (2004, PAKDD, 3) use it for repeated cross-validation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import t as student

from ajgdata.evaluate import metrics
from ajgdata.evaluate.agreement import UNDEFINED, Interval
from ajgdata.evaluate.crossval import Predictions
from ajgdata.evaluate.intervals import CONFIDENCE, ROUNDING
from ajgdata.evaluate.metrics import wrapped


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

    >>> from ajgdata.evaluate.resampling import corrected_interval
    >>> low, high = corrected_interval([1.0, 2.0, 3.0, 4.0, 5.0], folds=5)
    >>> f"{low:.3f} {high:.3f}"  # 3 ± 2.776 sqrt((1/5 + 1/4) 2.5)
    '0.055 5.945'
    """
    found = np.asarray(values, float)
    if len(found) < 2 or not np.isfinite(found).all():
        return UNDEFINED
    if np.ptp(found) <= ROUNDING * np.abs(found).max():
        return UNDEFINED
    reach = corrected_reach(float(found.var(ddof=1)), len(found), 1 / (folds - 1))
    least, most = metrics.RANGES.get(metric, (-math.inf, math.inf))
    mean = float(found.mean())
    return Interval(max(mean - reach, least), min(mean + reach, most))


def repeat_seed(seed: int, repeat: int) -> int:
    """Return the seed of a repeat: that of the task for the first."""
    return int(np.random.SeedSequence([seed, repeat]).generate_state(1)[0]) if repeat else seed


RESAMPLES = 2000


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
