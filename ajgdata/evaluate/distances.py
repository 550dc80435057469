"""Distances in a space: how far recordings lie apart, and finding others of a thing by nearness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist
from sklearn.metrics import silhouette_score

from ajgdata.types import NotPossibleError


@dataclass(frozen=True)
class Retrieved:
    """`precision` at each k asked for, mean over queries, and what random order would give."""

    precision: tuple[float, ...]
    chance: float
    queries: int


def precision_at(
    space: np.ndarray,
    instance: np.ndarray,
    grasp: np.ndarray,
    *,
    queries: np.ndarray,
    gallery: np.ndarray,
    at: Sequence[int],
) -> Retrieved:
    """Return the share of a query's k nearest that are of the same thing; its own grasp does not
    count.

    `space` (n, d) holds a point for each recording, `instance` and `grasp` (n,) its labels;
    `queries` and `gallery` are row numbers. Queries are left out that have fewer than max(k)
    recordings to find in the gallery, so that 1 can be reached. Ties keep the gallery's order.
    Raises ValueError when no query is left.
    """
    own = grasp[queries][:, None] == grasp[gallery][None]
    wanted = (instance[queries][:, None] == instance[gallery][None]) & ~own
    enough = wanted.sum(axis=1) >= max(at)
    if not enough.any():
        raise NotPossibleError(
            f"no thing has {max(at)} recordings besides those of a query's grasp"
        )
    own, wanted = own[enough], wanted[enough]
    distance = cdist(space[queries[enough]], space[gallery])
    distance[own] = np.inf
    order = np.argsort(distance, axis=1, kind="stable")[:, : max(at)]
    is_same_thing = np.take_along_axis(wanted, order, axis=1)
    return Retrieved(
        precision=tuple(float(is_same_thing[:, :k].mean()) for k in at),
        chance=float(np.mean(wanted.sum(axis=1) / (~own).sum(axis=1))),
        queries=len(is_same_thing),
    )


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
