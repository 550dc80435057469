"""Dimension reduction by PCA and UMAP, for comparison with embeddings and for figures.

Both are fitted to training points, then applied to the other points.
"""

from __future__ import annotations

import warnings
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from sklearn.decomposition import PCA
from threadpoolctl import threadpool_limits

from ajgdata.types import NotPossibleError

Real = NDArray[np.floating]

ReducerName = Literal["pca", "umap"]
REDUCERS: tuple[ReducerName, ...] = ("pca", "umap")
#: Smallest number of distinct training points for UMAP, which uses 15 neighbours of a point.
MIN_UMAP_POINTS = 16


def make_reducer(name: ReducerName, dimension: int, seed: int) -> Any:
    """Return an unfitted reducer with the default settings of its library.

    `fit_transform` learns from points (n, f) and returns reduced points (n, dimension); `transform`
    reduces other points. The same seed gives the same points.
    """
    if name == "pca":
        return PCA(dimension, random_state=seed)
    with warnings.catch_warnings():  # TensorFlow is needed for parametric UMAP only
        warnings.filterwarnings("ignore", "Tensorflow not installed", ImportWarning)
        from umap import UMAP

    return UMAP(n_components=dimension, n_jobs=1, random_state=seed, transform_seed=seed)


def is_reducible(dimension: int, rows: int) -> bool:
    """Return whether this number of recordings can be reduced to `dimension` dimensions.

    UMAP starts from `dimension` + 1 eigenvectors of the graph of the recordings.
    """
    return dimension + 1 < rows


def project(points: Real, training: NDArray[np.bool_], seed: int = 0) -> dict[str, Real]:
    """Return points (n, d) reduced to two dimensions (n, 2), float32, by the name of the reducer.

    `training` (n,) are the points to which PCA and UMAP are fitted. UMAP is omitted if there are
    fewer than MIN_UMAP_POINTS distinct training points. The same points and seed give the same
    result. Raises NotPossibleError for fewer than two training points.
    """
    points = np.ascontiguousarray(points, np.float32)
    if np.count_nonzero(training) < 2:
        raise NotPossibleError("at least two training points are required")
    if points.shape[1] < 2:  # the second coordinate of points on a line is 0
        points = np.pad(points, ((0, 0), (0, 2 - points.shape[1])))
    with threadpool_limits(limits=1):  # the order of additions is then always the same
        planes = {"pca": _pca(points, training)}
        if len(np.unique(points[training], axis=0)) >= MIN_UMAP_POINTS:
            planes["umap"] = _umap(points, training, seed)
    return {name: np.asarray(plane, np.float32) for name, plane in planes.items()}


def _pca(points: Real, training: NDArray[np.bool_]) -> Real:
    """Return points (n, d) in the plane (n, 2) of the first two principal components."""
    centred = points - points[training].mean(axis=0)
    _, _, directions = np.linalg.svd(centred[training], full_matrices=False)
    # The sign of a direction is arbitrary: make its largest coefficient positive.
    largest = np.abs(directions[:2]).argmax(axis=1)
    signs = np.sign(directions[[0, 1], largest])
    return centred @ (directions[:2] * signs[:, None]).T


def _umap(points: Real, training: NDArray[np.bool_], seed: int) -> Real:
    """Return points (n, d) in the plane (n, 2) of UMAP."""
    umap = make_reducer("umap", 2, seed)
    plane = np.empty((len(points), 2), np.float32)
    plane[training] = umap.fit_transform(points[training])
    if not training.all():
        plane[~training] = umap.transform(points[~training])
    return plane
