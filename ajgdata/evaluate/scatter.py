"""Scatter within classes: its size, and its effective number of directions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike


class Scatter(NamedTuple):
    """Root mean square of the scatter, in the unit of the values, and its effective dimension.

    The effective dimension is (Σ λ)² / Σ λ² of the variances λ along the principal axes (the
    participation ratio): 1 for a single direction, k for k directions of equal variance.
    """

    rms: float
    dimension: float


def within_class_scatter(values: ArrayLike, classes: ArrayLike) -> Scatter:
    """Return the scatter of values (n, f), e.g. levels in dB, around the mean of their class.

    `classes` (n,) are labels; a class with one row has no scatter. Raises ValueError if no class
    has two rows.

    >>> levels_db = [[0, 0], [2, 0], [5, 5], [7, 5]]
    >>> within_class_scatter(levels_db, ["a", "a", "b", "b"])
    Scatter(rms=1.0, dimension=1.0)
    """
    values = np.asarray(values, float)
    labels = np.asarray(classes)
    residuals = []
    for label in np.unique(labels):
        own = values[labels == label]
        if len(own) > 1:
            residuals.append(own - own.mean(axis=0))
    if not residuals:
        raise ValueError("no class has two rows: scatter needs at least two")
    deviation = np.concatenate(residuals)
    freedom = len(deviation) - len(residuals)
    variance = np.linalg.svd(deviation, compute_uv=False) ** 2
    rms = np.sqrt(np.sum(deviation**2) / (freedom * values.shape[1]))
    dimension = np.sum(variance) ** 2 / np.sum(variance**2) if variance.any() else 0.0
    return Scatter(float(rms), float(dimension))
