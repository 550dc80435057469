"""How many recordings a model learns from at most, where its cost would else run away.

Support vectors and neighbours cost as the square of the recordings, and a choice among candidates
is made of many such fits. Beyond its limit a model learns from fewer recordings of each group, not
from fewer groups as long as there is one of each: recordings of a grasp are near copies. Where a
group holds several classes or values, as a session does, each of them loses some.
`benchmarks/models.py` measures what training at a limit and beyond it costs.
"""

from __future__ import annotations

from bisect import bisect_right
from typing import Any

import numpy as np
from sklearn.neighbors import KNeighborsClassifier, KNeighborsRegressor
from sklearn.neural_network import MLPClassifier, MLPRegressor
from sklearn.svm import SVC, SVR

#: By type of the model proper, and of what is made from it. A class may declare `most_recordings`
#: itself, which goes first; those that are neither learn from all.
MOST: dict[type, int] = {
    SVC: 5_000,  # the kernel of all pairs
    SVR: 5_000,
    KNeighborsClassifier: 20_000,  # is kept whole, and asked whole for each recording
    KNeighborsRegressor: 20_000,
    MLPClassifier: 10_000,  # epochs until its loss no longer falls
    MLPRegressor: 10_000,
}
#: Recordings that a tuned model is chosen on; what is chosen then learns from its own most.
MOST_TO_CHOOSE = 5_000
#: Names under which an estimator holds the one that it wraps, unfitted.
_WRAPPED = ("estimator", "regressor")


def most_recordings(model: Any) -> int | None:
    """Return how many recordings a model learns from at most, None for all of them."""
    if hasattr(model, "most_recordings"):
        return model.most_recordings
    steps = getattr(model, "steps", None)
    if steps:
        return most_recordings(steps[-1][1])
    for known, most in MOST.items():
        if isinstance(model, known):
            return most
    for name in _WRAPPED:
        if hasattr(model, name):
            return most_recordings(getattr(model, name))
    return None


def learned_rows(model: Any, groups: np.ndarray | None, target: np.ndarray) -> np.ndarray | None:
    """Return which recordings, of targets (n,) and groups (n,), a model learns from; None for
    all."""
    most, count = most_recordings(model), len(target)
    if most is None or count <= most:
        return None
    return thinned(np.arange(count) if groups is None else np.asarray(groups), most, target)


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
