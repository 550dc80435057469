"""Learning curves: accuracy against the number of training groups (grasps) per class."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from threadpoolctl import threadpool_limits

from ajgdata.evaluate import metrics
from ajgdata.evaluate.splits import grouped_folds
from ajgdata.models import fit_named_model
from ajgdata.models.limits import most_recordings
from ajgdata.types import Kind, NotPossibleError


@dataclass(frozen=True)
class CurvePoint:
    """One draw of training groups: `groups` of each class (of each value, for a regression)."""

    groups: int
    repeat: int
    recordings: int  #: that were learned from
    scores: dict[str, float]  #: on the validation rows, which all points share
    chance: dict[str, float]  #: the same of a guess that knows the training rows' targets only


@dataclass(frozen=True)
class Curve:
    """The points of all sizes that could be learned from, and why not of the `others`."""

    points: tuple[CurvePoint, ...]
    others: dict[int, str]


def learning_curve(
    features: np.ndarray,
    target: np.ndarray,
    groups: np.ndarray | Sequence,
    *,
    kind: Kind,
    model: str,
    sizes: Sequence[int],
    repeats: int,
    folds: int = 5,
    seed: int = 0,
    period: float | None = None,
    limits: Mapping[str, int] | None = None,
) -> Curve:
    """Train on ever more groups per class, and test always on the same: those of the first fold.

    `features` (n, n_features), `target` (n,), `groups` (n,) as for `cross_validate`. Each repeat
    draws an order of every class's training groups and takes the first of them, so that a larger
    size holds the smaller; its seed is the model's as well. A size that some class has too few
    training groups for, or that the model cannot learn from, leaves the others as they are.

    Raises NotPossibleError where fewer than two sizes are left (of several), and for a group of
    several classes.
    """
    y = np.asarray(target)
    group = np.unique(np.asarray(groups), return_inverse=True)[1]
    train, test = grouped_folds(y, group, kind, folds, seed)[0]
    of_class = _groups_of_classes(y[train], group[train])
    fewest = min(map(len, of_class))
    short = f"a class has {fewest}; lower learning_curve.groups, or record more"
    others = {size: short for size in sizes if size > fewest}
    most = most_recordings(model, limits or {})

    def point(size: int, repeat: int) -> CurvePoint:
        generator = np.random.default_rng([seed, repeat])
        orders = [generator.permutation(members) for members in of_class]
        rows = train[np.isin(group[train], np.concatenate([order[:size] for order in orders]))]
        fitted = fit_named_model(
            model, kind, features[rows], y[rows], group[rows],
            seed=seed + repeat, period=period, limits=limits,
        )  # fmt: skip
        scores = metrics.score(y[test], fitted.predict(features[test]), kind, period)
        chance = metrics.chance(y[rows], y[test], kind, period)
        used = min(len(rows), most or len(rows))
        return CurvePoint(size, repeat, used, scores, chance)

    points = []
    with threadpool_limits(limits=1):
        for repeat, size in product(range(repeats), sizes):
            if size not in others:
                try:
                    points.append(point(size, repeat))
                except NotPossibleError as error:
                    others[size] = str(error)
    if len(sizes) - len(others) < min(2, len(sizes)):
        told = "; ".join(f"{size} training groups per class: {others[size]}" for size in others)
        raise NotPossibleError(f"fewer than two points of the curve: {told}")
    return Curve(tuple(one for one in points if one.groups not in others), others)


def _groups_of_classes(y: np.ndarray, group: np.ndarray) -> list[np.ndarray]:
    """Return the groups of each class. Raises ValueError for a group that several share."""
    of_class = [np.unique(group[y == label]) for label in np.unique(y)]
    if sum(map(len, of_class)) > len(np.unique(group)):
        raise NotPossibleError(
            "a group holds several classes: groups of one class cannot be counted"
        )
    return of_class
