"""How many recordings a model learns from at most, where its cost would else run away.

Support vectors and neighbours cost as the square of the recordings, and a choice among candidates
is made of many such fits. Beyond its limit a model learns from fewer recordings of each group, not
from fewer groups as long as there is one of each: recordings of a grasp are near copies.
`benchmarks/models.py` measures what training at a limit and beyond it costs.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from sklearn.neighbors import KNeighborsClassifier, KNeighborsRegressor
from sklearn.neural_network import MLPClassifier, MLPRegressor
from sklearn.svm import SVC, SVR

#: By type of the model proper. Others may declare `most_recordings` themselves; without, they
#: learn from all.
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
    steps = getattr(model, "steps", None)
    if steps:
        return most_recordings(steps[-1][1])
    if type(model) in MOST:
        return MOST[type(model)]
    for name in _WRAPPED:
        if hasattr(model, name):
            return most_recordings(getattr(model, name))
    return getattr(model, "most_recordings", None)


def learned_rows(model: Any, groups: np.ndarray | None, count: int) -> np.ndarray | None:
    """Return which of `count` recordings of `groups` (n,) a model learns from; None for all."""
    most = most_recordings(model)
    if most is None or count <= most:
        return None
    return thinned(np.arange(count) if groups is None else np.asarray(groups), most)


def thinned(groups: np.ndarray, most: int) -> np.ndarray:
    """Return `most` sorted row numbers, as evenly as can be of `groups` (n,): the first recording
    of every group, then the second, and so on; in the last round of groups evenly spaced.

    >>> from ajgdata.models.limits import thinned
    >>> thinned(np.array([7, 7, 7, 7, 8, 8, 9]), 5).tolist()
    [0, 1, 4, 5, 6]
    """
    group = np.unique(groups, return_inverse=True)[1]
    order = np.argsort(group, kind="stable")
    first = np.searchsorted(group[order], group[order])
    turn = np.arange(len(group)) - first  # of each row among those of its group
    by_turn = np.argsort(turn, kind="stable")
    if most >= len(group):
        return np.arange(len(group))
    last = turn[by_turn[most]]  # the round that does not come to its end
    whole, partly = np.flatnonzero(turn < last), np.flatnonzero(turn == last)
    places = np.linspace(0, len(partly), most - len(whole), endpoint=False).astype(int)
    return np.sort(order[np.concatenate([whole, partly[places]])])
