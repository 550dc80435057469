"""Finding other recordings of a thing by their nearness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist


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
    """Share of a query's k nearest that are of the same thing; its own grasp does not count.

    `space` (n, d) holds a point for each recording, `instance` and `grasp` (n,) its labels;
    `queries` and `gallery` are row numbers. Queries are left out that have fewer than max(k)
    recordings to find in the gallery, so that 1 can be reached. Ties keep the gallery's order.
    Raises ValueError when no query is left.
    """
    distance = cdist(space[queries], space[gallery])
    own = grasp[queries][:, None] == grasp[gallery][None]
    wanted = (instance[queries][:, None] == instance[gallery][None]) & ~own
    enough = wanted.sum(axis=1) >= max(at)
    if not enough.any():
        raise ValueError(f"no thing has {max(at)} recordings besides those of a query's grasp")
    distance[own] = np.inf
    order = np.argsort(distance[enough], axis=1, kind="stable")[:, : max(at)]
    found = np.take_along_axis(wanted[enough], order, axis=1)
    return Retrieved(
        precision=tuple(float(found[:, :k].mean()) for k in at),
        chance=float(np.mean(wanted[enough].sum(axis=1) / (~own[enough]).sum(axis=1))),
        queries=int(enough.sum()),
    )
