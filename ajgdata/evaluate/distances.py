"""Distances in a space: how far recordings lie apart."""

from __future__ import annotations

import numpy as np
from scipy.spatial.distance import cdist
from sklearn.metrics import silhouette_score


def mean_distances(
    space: np.ndarray, label: np.ndarray, names: np.ndarray, apart: np.ndarray
) -> np.ndarray:
    """Return the mean Euclidean distance (c, c) between the recordings of each two of `names`.

    `space` (n, d), `label` (n,); only pairs that differ in `apart` (n,) count, such as the grasp.
    NaN where there is none. The diagonal holds the distances within a label.
    """
    member = (label[:, None] == names[None]).astype(float)  # (n, c)
    counts = (apart[:, None] != apart[None]).astype(float)
    number = member.T @ counts @ member
    total = member.T @ (cdist(space, space) * counts) @ member
    return np.where(number > 0, total / np.where(number > 0, number, 1), np.nan)


def silhouette(space: np.ndarray, label: np.ndarray) -> float:
    """Return the mean silhouette (Rousseeuw 1987) of points (n, d) with labels (n,), NaN unless
    there are 2 to n - 1 labels."""
    if not 2 <= len(np.unique(label)) < len(label):
        return float("nan")
    return float(silhouette_score(space, label))
