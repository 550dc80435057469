"""Spaces as points of a plane, and the columns by which recordings are told apart in them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.floating]

#: Names of spaces.
SPACES = {"latent": "latent", "raw": "raw features", "pca": "PCA", "umap": "UMAP"}
#: The method of a space that has two dimensions and is shown as it is.
PLANE = "plane"
#: Names of projections.
METHODS = {"pca": "PCA", "umap": "UMAP", "tsne": "t-SNE", PLANE: "2-D"}
#: Distinct texts beyond these share colours; more than that no legend tells apart.
MANY = 20


@dataclass(frozen=True, eq=False)
class Projection:
    """A space as points of a plane: `points` (n, 2) of every recording by one encoder."""

    space: str
    method: str
    points: Real


@dataclass(frozen=True, eq=False)
class Projections:
    """All projections of one run, with what is known of each recording.

    `training` (n,): whether the encoder was trained on it. `columns`: text or numbers (n,) by
    name, the first of them the thing itself.
    """

    recording: NDArray[np.str_]
    training: NDArray[np.bool_]
    columns: Mapping[str, NDArray]
    projections: tuple[Projection, ...]


def shown_columns(shown: Projections) -> list[str]:
    """Return the columns that can be coloured: numbers that differ, or some distinct texts."""
    found = []
    for name, values in shown.columns.items():
        if values.dtype.kind == "U":
            distinct = len({value for value in values.tolist() if value})
            if 1 < distinct <= MANY:
                found.append(name)
        elif len(np.unique(values[np.isfinite(values)])) > 1:
            found.append(name)
    return found
