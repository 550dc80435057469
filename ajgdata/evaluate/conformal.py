"""Quantiles that hold on grasps never met: of residuals, of distances.

Grasps, not recordings, are exchangeable, so each grasp has the same weight however many recordings
it has (Lee, Barber, Willett 2023, arXiv 2306.06342), and one weight is left for the new one.
"""

from __future__ import annotations

import numpy as np


def weighted_quantile(values: np.ndarray, weights: np.ndarray, share: float) -> np.ndarray:
    """Return the least of `values` (m, n) per column whose `weights` (m,) add up to `share`.

    Infinity where all of them together do not.
    """
    order = np.argsort(values, axis=0)
    reached = np.cumsum(weights[order], axis=0) >= share - 1e-12
    first = np.argmax(reached, axis=0)
    found = np.take_along_axis(np.take_along_axis(values, order, 0), first[None], 0)[0]
    return np.where(reached.any(axis=0), found, np.inf)


def grasp_weights(groups: np.ndarray) -> np.ndarray:
    """Return weights (m,), equal for all groups, that leave 1 / (groups + 1) for a new one."""
    _, inverse, counts = np.unique(groups, return_inverse=True, return_counts=True)
    return 1.0 / (counts[inverse] * (len(counts) + 1))
