"""Distances of all pairs of few points, as UMAP takes them from scikit-learn.

UMAP gives scikit-learn its own compiled distance, which then calls it from Python for each pair:
that takes longer than all the rest of a fit to 500 spectra. Here the loops are compiled, too; the
distances are the same but for the order of their sums, which is the compiler's.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from sklearn.metrics import pairwise_distances
from umap.distances import euclidean


@numba.njit(fastmath=True)
def _distance(x: np.ndarray, y: np.ndarray) -> float:
    """Return what `umap.distances.euclidean` does; it stands here, too, because numba looks at
    this file alone when it asks whether what it keeps is current."""
    total = 0.0
    for n in range(x.shape[0]):
        total += (x[n] - y[n]) ** 2
    return np.sqrt(total)


@numba.njit
def _distances(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    found = np.empty((len(x), len(y)), x.dtype)
    for i in range(len(x)):
        for j in range(len(y)):
            found[i, j] = _distance(x[i], y[j])
    return found


def pair_distances(
    X: np.ndarray, Y: np.ndarray | None = None, *, metric: Any = "euclidean", **named: Any
) -> np.ndarray:
    """Return the distances (n, m) of points X (n, d) from points Y (m, d), or from X itself.

    As `sklearn.metrics.pairwise_distances`, which makes all but Euclidean ones of UMAP.
    """
    others = X if Y is None else Y
    plain = all(isinstance(points, np.ndarray) for points in (X, others))
    if metric is not euclidean or named or not plain or X.dtype != others.dtype:
        return pairwise_distances(X, Y, metric=metric, **named)
    return np.asarray(_distances(X, others))
