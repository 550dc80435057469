"""Distances in a space: how far recordings lie apart, and finding others of a thing by nearness."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist
from sklearn.metrics import silhouette_score

from ajgdata.models.limits import thinned
from ajgdata.types import NotPossibleError

#: Distances that are held at once: 64 MB, and as much again while they are sorted.
BLOCK = 2**23
#: Points that a silhouette is measured on.
MOST_SILHOUETTE = 5_000


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
    found, shares = [], []
    for some in in_blocks(queries, len(gallery)):
        own = grasp[some][:, None] == grasp[gallery][None]
        wanted = (instance[some][:, None] == instance[gallery][None]) & ~own
        enough = wanted.sum(axis=1) >= max(at)
        distance = cdist(space[some[enough]], space[gallery])
        distance[own[enough]] = np.inf
        order = np.argsort(distance, axis=1, kind="stable")[:, : max(at)]
        found.append(np.take_along_axis(wanted[enough], order, axis=1))
        shares.append(wanted[enough].sum(axis=1) / (~own[enough]).sum(axis=1))
    if not sum(map(len, found)):
        raise NotPossibleError(
            f"no thing has {max(at)} recordings besides those of a query's grasp"
        )
    is_same_thing = np.concatenate(found)
    return Retrieved(
        precision=tuple(float(is_same_thing[:, :k].mean()) for k in at),
        chance=float(np.mean(np.concatenate(shares))),
        queries=len(is_same_thing),
    )


def in_blocks(rows: np.ndarray, others: int) -> Iterator[np.ndarray]:
    """Yield row numbers (n,) in turn, so few at once that distances to `others` points fit into
    BLOCK; at least one."""
    size = max(1, BLOCK // max(others, 1))
    for start in range(0, len(rows), size):
        yield rows[start : start + size]


def mean_distances(
    space: np.ndarray, label: np.ndarray, names: np.ndarray, apart: np.ndarray
) -> np.ndarray:
    """Return the mean Euclidean distance (c, c) between the recordings of each two of `names`.

    `space` (n, d), `label` (n,); only pairs that differ in `apart` (n,) count, such as the grasp.
    NaN where there is none. The diagonal holds the distances within a label.
    """
    member = (label[:, None] == names[None]).astype(float)  # (n, c)
    number, total = np.zeros((2, len(names), len(names)))
    for rows in in_blocks(np.arange(len(space)), len(space)):
        counts = (apart[rows][:, None] != apart[None]).astype(float)
        number += member[rows].T @ counts @ member
        total += member[rows].T @ (cdist(space[rows], space) * counts) @ member
    return np.where(number > 0, total / np.where(number > 0, number, 1), np.nan)


def silhouette(space: np.ndarray, label: np.ndarray) -> float:
    """Return the mean silhouette (Rousseeuw 1987) of points (n, d) with labels (n,), NaN unless
    there are 2 to n - 1 labels; of more than MOST_SILHOUETTE points that of so many, of each label
    evenly spaced."""
    if len(label) > MOST_SILHOUETTE:
        some = thinned(label, MOST_SILHOUETTE)
        space, label = space[some], label[some]
    if not 2 <= len(np.unique(label)) < len(label):
        return float("nan")
    return float(silhouette_score(space, label))
