"""Errors over repeated fits: the median and an interval over grasps and fits.

One cross-validation has one set of folds and one random state of the network. Far outside the
training data a network extrapolates, and its error then depends on both: a single value, or the
spread over its folds, does not say what another fit would give.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ajgdata.evaluate.crossval import Predictions
from ajgdata.evaluate.metrics import wrapped
from ajgdata.evaluate.resampling import CONFIDENCE

RESAMPLES = 2000
#: Percentiles of the errors of single grasps that are reported.
GRASP_PERCENTILES = (5, 50, 95)


class RobustError(NamedTuple):
    """RMSE over repeated fits, in the unit of the target.

    `median` is over fits, of the RMSE over all grasps; `low` and `high` are the ends of its 95 %
    bootstrap interval, for which grasps and fits are drawn together. `per_fit` (fits,) are the
    values of the fits. `grasps` are percentiles over grasps (GRASP_PERCENTILES) of the RMSE of one
    grasp, which is the median over fits.
    """

    median: float
    low: float
    high: float
    per_fit: np.ndarray
    grasps: np.ndarray


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
    per_grasp = np.percentile(np.median(np.sqrt(squared), axis=0), GRASP_PERCENTILES)
    return RobustError(float(np.median(per_fit)), float(low), float(high), per_fit, per_grasp)
