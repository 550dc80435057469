"""PCA and UMAP as rivals of a latent: fitted on some recordings, applied to others."""

from __future__ import annotations

import warnings
from typing import Literal, Protocol, cast

import numpy as np

ReducerName = Literal["pca", "umap"]
REDUCERS: tuple[ReducerName, ...] = ("pca", "umap")


class Reducer(Protocol):
    """Both methods take (n, f) and give (n, dimension)."""

    def fit_transform(self, X: np.ndarray) -> np.ndarray:
        """Learn from X, and where X then lies."""
        ...

    def transform(self, X: np.ndarray) -> np.ndarray:
        """Where further points lie."""
        ...


def make_reducer(name: ReducerName, dimension: int, seed: int) -> Reducer:
    """An unfitted reducer with its library's defaults; the same seed gives the same points."""
    if name == "pca":
        from sklearn.decomposition import PCA

        return cast(Reducer, PCA(dimension, random_state=seed))
    with warnings.catch_warnings():  # about TensorFlow, which only parametric UMAP needs
        warnings.filterwarnings("ignore", "Tensorflow not installed", ImportWarning)
        from umap import UMAP
    seeds = {"random_state": seed, "transform_seed": seed}
    return cast(Reducer, UMAP(n_components=dimension, n_jobs=1, **seeds))


def reducible(dimension: int, rows: int) -> bool:
    """Whether `rows` recordings can be reduced to so many dimensions: UMAP begins with as many
    eigenvectors of their graph, and one more."""
    return dimension + 1 < rows
