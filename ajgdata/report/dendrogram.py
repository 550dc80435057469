"""Distances -> the tree that joins what is near."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.floating]


class Tree(NamedTuple):
    """Which objects lie together: `order` of the leaves, and the links of scipy's dendrogram."""

    order: list[int]
    links: Real


def tree(distance: Real, names: Sequence[str]) -> Tree | None:
    """Return the average linkage of a distance matrix (o, o), whose diagonal does not matter.

    Neighbouring leaves are as near as the tree allows, and the name of the first leaf comes before
    that of the last in the alphabet: the order of the objects does not matter. Distances that are
    not known (NaN) count as the largest. None for less than two objects.
    """
    from scipy.cluster.hierarchy import dendrogram, linkage
    from scipy.spatial.distance import squareform

    if len(names) < 2:
        return None
    sorting = np.argsort(np.asarray(names), kind="stable")
    sorted_ = np.asarray(distance, float)[np.ix_(sorting, sorting)]
    # Both halves are the same but for round-off, and links of equal length go by the alphabet.
    condensed = squareform((sorted_ + sorted_.T) / 2, checks=False)
    known = condensed[np.isfinite(condensed)]
    condensed = np.where(np.isfinite(condensed), condensed, known.max() if len(known) else 1.0)
    links = linkage(condensed, "average", optimal_ordering=True)
    leaves = dendrogram(links, no_plot=True)["leaves"]
    if leaves[0] > leaves[-1]:
        links[:, :2] = links[:, 1::-1]
        leaves = dendrogram(links, no_plot=True)["leaves"]
    return Tree([int(sorting[leaf]) for leaf in leaves], links)
