"""How many recordings a model learns from at most, where its cost would else run away.

Support vectors and neighbours cost as the square of the recordings, and a choice among candidates
is made of many such fits. Beyond its limit a model learns from fewer recordings of each group, not
from fewer groups as long as there is one of each: recordings of a grasp are near copies. Where a
group holds several classes or values, as a session does, each of them loses some. A task may set
other limits (`most_recordings` in dataset.yaml); one beyond which training would take longer than
MOST_HOURS by estimate is refused. `benchmarks/models.py` measures what training at a limit and
beyond it costs.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from ajgdata.types import NotPossibleError

#: What a task sets goes first, then what a class declares itself as `most_recordings`; models that
#: are not named here learn from all.
MOST: dict[str, int] = {
    "svm": 5_000,  # the kernel of all pairs
    "knn": 20_000,  # is kept whole, and asked whole for each recording
    "mlp": 10_000,  # epochs until its loss no longer falls
    "cnn": 10_000,  # each takes more than one step
    # what these learn from is held three times in float64: 25 kB a recording
    **dict.fromkeys(("linear", "ridge", "forest", "boosting"), 30_000),
}
#: Recordings that a tuned model is chosen on; what is chosen then learns from its own most. There
#: are eighteen candidates of k-NN and twelve of support vectors, which all cost as the square.
CHOOSING = "choosing"
MOST_TO_CHOOSE, CHOOSE = 5_000, {"knn": 2_000, "svm": 2_000}
#: Processor time of training on so many recordings of 1025 bins, and the exponent by which it
#: grows; of k-NN with as many predicted. By `benchmarks/models.py`, on one core of two.
COST: dict[str, tuple[int, float, float]] = {
    "svm": (5_000, 4.5, 2.0),
    "knn": (10_000, 4.1, 2.0),
    "mlp": (10_000, 4.4, 1.0),
    "cnn": (10_000, 28.0, 1.0),
}
#: Estimated training of one model, or choice among candidates, beyond which it is refused.
MOST_HOURS = 3.0
#: Under which names the limit of a class of scikit-learn may be set.
NAMES: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("SVC", "SVR"), ("svm",)),
    **dict.fromkeys(("KNeighborsClassifier", "KNeighborsRegressor"), ("knn",)),
    **dict.fromkeys(("MLPClassifier", "MLPRegressor"), ("mlp",)),
    "LogisticRegression": ("linear",),
    **dict.fromkeys(("Ridge", "RidgeClassifier"), ("ridge", "linear")),
    **dict.fromkeys(("RandomForestClassifier", "RandomForestRegressor"), ("forest",)),
    **dict.fromkeys(
        ("HistGradientBoostingClassifier", "HistGradientBoostingRegressor"), ("boosting",)
    ),
}
#: Names under which an estimator holds the one that it wraps, unfitted.
_WRAPPED = ("estimator", "regressor")
_declared: dict[str, int] = {}


@contextmanager
def declared(most: Mapping[str, int]) -> Iterator[None]:
    """Let models of these names learn from at most so many recordings, wherever they are trained in
    this process meanwhile; "choosing": all tuned ones, while they choose."""
    before = dict(_declared)
    _declared.update(most)
    try:
        yield
    finally:
        _declared.clear()
        _declared.update(before)


def names_of(model: Any) -> tuple[str, ...]:
    """Return the names under which the limit of a model may be set, none of other packages'."""
    for layer in _layers(model):
        for one in type(layer).__mro__:
            if one.__name__ in NAMES and one.__module__.startswith("sklearn."):
                return NAMES[one.__name__]
        if named := getattr(layer, "limit_name", ""):
            return (named,)
    return ()


def _layers(model: Any) -> Iterator[Any]:
    """Yield a model, then what it wraps, as deep as that goes: the last step of a pipeline, the
    estimator that is fitted to another target."""
    while model is not None:
        yield model
        wrapped = [getattr(model, name) for name in _WRAPPED if hasattr(model, name)]
        steps = getattr(model, "steps", None)
        model = steps[-1][1] if steps else next(iter(wrapped), None)


def most_recordings(model: Any) -> int | None:
    """Return how many recordings a model learns from at most, None for all of them."""
    names = names_of(model)
    for name in names:
        if name in _declared:
            return _declared[name]
    own = (one.most_recordings for one in _layers(model) if hasattr(one, "most_recordings"))
    if (most := next(own, None)) is not None:
        return most
    return next((MOST[name] for name in names if name in MOST), None)


def most_to_choose(model: Any) -> int:
    """Return how many recordings a tuned model with this candidate is chosen on at most."""
    if CHOOSING in _declared:
        return _declared[CHOOSING]
    return next((CHOOSE[name] for name in names_of(model) if name in CHOOSE), MOST_TO_CHOOSE)


def estimated_s(model: Any, recordings: int) -> float:
    """Return the processor time in s that training a model on so many recordings takes about, 0 for
    one that none is known of: t (n / n0)^p by COST."""
    for name in names_of(model):
        if name in COST:
            known, seconds, exponent = COST[name]
            return seconds * (recordings / known) ** exponent
    return 0.0


def check_cost(model: Any, recordings: int, fits: int = 1) -> None:
    """Raise NotPossibleError for a model that would be trained for longer than MOST_HOURS."""
    hours = fits * estimated_s(model, recordings) / 3600
    if hours > MOST_HOURS:
        times = f", {fits} times" if fits > 1 else ""
        problem = f"{names_of(model)[0]} would learn from {recordings:,} recordings{times}"
        cost = f"some {hours:,.0f} h of one core by estimate"
        raise NotPossibleError(f"{problem}: {cost}; lower most_recordings")


def learned_rows(model: Any, groups: np.ndarray | None, target: np.ndarray) -> np.ndarray | None:
    """Return which recordings, of targets (n,) and groups (n,), a model learns from; None for
    all. Raises NotPossibleError where they are too many by estimate."""
    most, count = most_recordings(model), len(target)
    check_cost(model, count if most is None else min(most, count))
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
