"""Fewer dimensions: PCA and UMAP in comparison with a latent, and as planes for figures.

Both are fitted on training points and then applied to the other points.
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
#: UMAP looks at 15 neighbours of a point: with fewer distinct training points only PCA is done.
FEWEST = 16


def make_reducer(name: ReducerName, dimension: int, seed: int) -> Any:
    """Return an unfitted reducer with its library's defaults; the same seed gives the same points.

    `fit_transform` learns from points (n, f) and returns them reduced (n, dimension); `transform`
    reduces further points.
    """
    if name == "pca":
        return PCA(dimension, random_state=seed)
    with warnings.catch_warnings():  # about TensorFlow, which only parametric UMAP needs
        warnings.filterwarnings("ignore", "Tensorflow not installed", ImportWarning)
        from umap import UMAP

    seeds = {"random_state": seed, "transform_seed": seed}
    return UMAP(n_components=dimension, n_jobs=1, **seeds)


def reducible(dimension: int, rows: int) -> bool:
    """Return True if `rows` recordings can be reduced to so many dimensions: UMAP begins with as
    many eigenvectors of their graph, and one more."""
    return dimension + 1 < rows


def project(points: Real, training: NDArray[np.bool_], seed: int = 0) -> dict[str, Real]:
    """Return points (n, d) in two dimensions by each of REDUCERS, as (n, 2) float32.

    `training` (n,) are the points that PCA and UMAP are fitted to. The same points and seed give
    the same result. Raises NotPossibleError for fewer than two training points.
    """
    points = np.ascontiguousarray(points, np.float32)
    if np.count_nonzero(training) < 2:
        raise NotPossibleError("at least two training points are required")
    if points.shape[1] < 2:  # a line is a plane whose second axis is empty
        points = np.pad(points, ((0, 0), (0, 2 - points.shape[1])))
    with threadpool_limits(limits=1):  # sums are then added up in one order
        planes = {"pca": _pca(points, training)}
        if len(np.unique(points[training], axis=0)) >= FEWEST:
            planes["umap"] = _umap(points, training, seed)
    return {name: np.asarray(plane, np.float32) for name, plane in planes.items()}


def _pca(points: Real, training: NDArray[np.bool_]) -> Real:
    centred = points - points[training].mean(axis=0)
    _, _, directions = np.linalg.svd(centred[training], full_matrices=False)
    # a direction has no sign: its largest part is positive
    largest = np.abs(directions[:2]).argmax(axis=1)
    return centred @ (directions[:2] * np.sign(directions[[0, 1], largest])[:, None]).T


def _umap(points: Real, training: NDArray[np.bool_], seed: int) -> Real:
    umap = make_reducer("umap", 2, seed)
    plane = np.empty((len(points), 2), np.float32)
    plane[training] = umap.fit_transform(points[training])
    if not training.all():
        plane[~training] = umap.transform(points[~training])
    return plane
