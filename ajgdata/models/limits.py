"""How many recordings a model is trained on at most, because its cost would otherwise run away.

Support vectors and neighbours cost as the square of the recordings, and a choice among candidates
consists of many such fits. `types.registry.MODELS` gives the limit of each model; a task may set
other limits (`most_recordings` in dataset.yaml). `benchmarks/models.py` measures the cost of
training at a limit and beyond it.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping

import numpy as np

from ajgdata.types import MODELS

#: Key of a task's limits for the recordings on which tuned models choose their settings.
CHOOSING = "choosing"


def most_recordings(name: str, declared: Mapping[str, int]) -> int | None:
    """Return the limit of a model of the registry; what a task has `declared` comes first.

    Plain and other variants of a model share its limit. None: it is trained on all recordings.
    """
    family = name.removesuffix("_plain").removesuffix("_one_scale")
    return declared.get(family, MODELS[name].most_recordings)


def thinned(groups: np.ndarray, most: int, target: np.ndarray | None = None) -> np.ndarray:
    """Return `most` sorted row numbers, as many as can be of every group of `groups` (n,), in it of
    every value of `target` (n,), and of these rows evenly spaced.

    Of more groups than `most` some are left out, evenly spaced in the order of their (first) value;
    of more values in a group than it has rows left likewise, in other groups others.

    >>> from ajgdata.models.limits import thinned
    >>> thinned(np.array([7, 7, 7, 7, 8, 8, 9]), 5).tolist()
    [0, 2, 4, 5, 6]
    >>> thinned(np.zeros(8), 4, np.array(list("aaaaaabb"))).tolist()
    [0, 3, 6, 7]
    """
    if most >= len(groups):
        return np.arange(len(groups))
    group = np.unique(groups, return_inverse=True)[1]
    value = np.zeros_like(group) if target is None else np.unique(target, return_inverse=True)[1]
    values = int(value.max()) + 1
    codes, part, rows = np.unique(group * values + value, return_inverse=True, return_counts=True)
    wanted = _wanted(codes // values, codes % values, rows, most)
    order = np.argsort(part, kind="stable")
    of = part[order]  # a group's rows of one value lie side by side
    place = np.arange(len(of)) - np.searchsorted(of, of)
    return np.sort(order[place * wanted[of] % rows[of] < wanted[of]])


def _wanted(group: np.ndarray, value: np.ndarray, rows: np.ndarray, most: int) -> np.ndarray:
    """Return how many rows to take of each part (p,), which is a value in a group, `most` in all;
    parts are sorted by group and value, and hold `rows` (p,)."""
    first = np.searchsorted(group, np.arange(group[-1] + 1))
    held = np.add.reduceat(rows, first)
    order = np.argsort(value[first], kind="stable")
    share = np.empty_like(held)
    share[order] = _shares(held[order], most)
    wanted = np.minimum(rows, share[group])
    parts = np.diff(first, append=len(rows))
    for number in np.flatnonzero((parts > 1) & (share < held)):
        here = slice(first[number], first[number] + parts[number])
        turned = np.roll(rows[here], -number)
        wanted[here] = np.roll(_shares(turned, share[number]), number)
    return wanted


def _shares(held: np.ndarray, most: int) -> np.ndarray:
    """Return `most` shared among parts that hold so many (p,), as evenly as can be; what is left
    over goes to parts evenly spaced."""
    full = range(int(held.max()) + 1)
    level = bisect_right(full, most, key=lambda each: np.minimum(held, each).sum()) - 1
    share = np.minimum(held, level)
    larger = np.flatnonzero(held > level)
    over = most - int(share.sum())
    share[larger[np.arange(over) * len(larger) // max(over, 1)]] += 1
    return share
