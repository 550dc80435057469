"""A model of one gripper on another, with and without a few grasps of the other to train on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from sklearn.base import BaseEstimator
from threadpoolctl import threadpool_limits

from ajgdata.evaluate import metrics
from ajgdata.evaluate.crossval import ExtraTestSet
from ajgdata.evaluate.splits import grouped_folds
from ajgdata.models import fit_named_model
from ajgdata.types import Kind, NotPossibleError


@dataclass(frozen=True)
class CrossGripperPoint:
    """One training: `grasps` groups of each class of the other gripper were added to it.

    `scores` are on the other gripper's groups of this fold, `chance` those of a model that ignores
    its input; `home` are on the same groups of the gripper itself, empty if it has none of them or
    if there were calibration grasps.
    """

    grasps: int
    fold: int
    recordings: int  #: of the other gripper that were trained on
    scores: dict[str, float]
    chance: dict[str, float]
    home: dict[str, float]


def cross_gripper(
    own: ExtraTestSet,
    other: ExtraTestSet,
    *,
    kind: Kind,
    model: str,
    sizes: Sequence[int],
    folds: int = 5,
    seed: int = 0,
    period: float | None = None,
    limits: Mapping[str, int] | None = None,
) -> list[CrossGripperPoint]:
    """Train on all of `own` and on `sizes` groups of each class (each value, of a regression) of
    `other`; test on the rest of `other`, fold by fold.

    A fold of `other` holds as many groups of each class as there are in all, divided by the folds.
    What is tested is trained on in neither gripper: groups of the same name in `own` are left out.
    Calibration groups of a larger size hold those of the smaller. Raises ValueError for a size that
    some class has too few groups for.
    """
    class_of = other.target.astype(str)
    points = []
    with threadpool_limits(limits=1):
        splits = grouped_folds(class_of, other.groups, "classification", folds, seed)
        for fold, (rest, test) in enumerate(splits):
            tested = np.isin(own.groups, other.groups[test])
            generator = np.random.default_rng([seed, fold])
            orders = calibration_groups(class_of[rest], other.groups[rest], max(sizes), generator)
            for size in sizes:
                chosen = np.concatenate([order[:size] for order in orders])
                added = rest[np.isin(other.groups[rest], chosen)]
                x = np.concatenate([own.features[~tested], other.features[added]])
                y = np.concatenate([own.target[~tested], other.target[added]])
                group = np.concatenate([own.groups[~tested], other.groups[added]])
                fitted = fit_named_model(
                    model, kind, x, y, group, seed=seed, period=period, limits=limits
                )

                at_home = tested.any() and not size
                points.append(
                    CrossGripperPoint(
                        grasps=size,
                        fold=fold,
                        recordings=len(added),
                        scores=_score(fitted, other, test, kind, period),
                        chance=metrics.chance(y, other.target[test], kind, period),
                        home=_score(fitted, own, tested, kind, period) if at_home else {},
                    )
                )
    return points


def _score(
    fitted: BaseEstimator, tests: ExtraTestSet, rows: np.ndarray, kind: Kind, period: float | None
) -> dict[str, float]:
    return metrics.score(tests.target[rows], fitted.predict(tests.features[rows]), kind, period)


def calibration_groups(
    class_of: np.ndarray, group: np.ndarray, most: int, generator: np.random.Generator
) -> list[np.ndarray]:
    """Return the groups of each class, in random order."""
    orders = [generator.permutation(np.unique(group[class_of == c])) for c in np.unique(class_of)]
    if most > (fewest := min(map(len, orders))):
        problem = f"{most} calibration grasps: a class has {fewest} that are not tested"
        raise NotPossibleError(f"{problem}; lower calibrate.grasps, or record more")
    return orders
