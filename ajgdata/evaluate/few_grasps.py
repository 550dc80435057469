"""Scores of models that are trained on few grasps: learning curves, and another gripper."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np
from sklearn.base import BaseEstimator
from threadpoolctl import threadpool_limits

from ajgdata.evaluate import metrics
from ajgdata.evaluate.agreement import UNDEFINED, Interval
from ajgdata.evaluate.intervals import CONFIDENCE, MIN_GRASPS, RESAMPLES, ROUNDING
from ajgdata.evaluate.splits import grouped_folds
from ajgdata.evaluate.task_data import TaskData
from ajgdata.models import fit_named_model
from ajgdata.types import MODELS, Kind, NotPossibleError


@dataclass(frozen=True)
class CurvePoint:
    """Scores of one model that was trained on `groups` groups of each class (or value)."""

    groups: int
    repeat: int
    recordings: int  #: recordings that the model was trained on
    scores: dict[str, float]  #: metrics on the validation rows, which are the same for all points
    chance: dict[str, float]  #: metrics of a guess from the targets of the training rows
    correct: dict[str, float]  #: share of correct recordings by validation grasp; classes only


@dataclass(frozen=True)
class Curve:
    """Points of a learning curve, and the reason for each size in `skipped`."""

    points: tuple[CurvePoint, ...]
    skipped: dict[int, str]


def learning_curve(
    data: TaskData,
    *,
    kind: Kind,
    model: str,
    sizes: Sequence[int],
    repeats: int,
    folds: int = 5,
    seed: int = 0,
    period: float | None = None,
) -> Curve:
    """Compute the scores for each number of training groups per class (`sizes`).

    All points are tested on the validation groups of the first fold. Each repeat draws an order of
    the training groups of each class and uses the first `size` groups; the model has the seed
    `seed` + repeat. Impossible sizes are skipped. Raises NotPossibleError for fewer than two
    possible sizes (of several), and for a group of several classes.
    """
    train, test = grouped_folds(data.value, data.group, kind, folds, seed)[0]
    known = data.where(train)
    tested = data.where(test)
    fewest = _fewest_groups(known)
    problem = f"a class has {fewest}; lower learning_curve.groups, or record more"
    skipped = {size: problem for size in sizes if size > fewest}
    points = []
    with threadpool_limits(limits=1):
        for repeat, size in product(range(repeats), sizes):
            if size in skipped:
                continue
            random = np.random.default_rng([seed, repeat])
            orders = _ordered_groups(known.value, known.group, random)
            rows = known.where(_in_first_groups(orders, size, known.group))
            try:
                fitted = fit_named_model(
                    model,
                    kind,
                    rows.feature,
                    rows.value,
                    rows.group,
                    seed=seed + repeat,
                    period=period,
                )
            except NotPossibleError as error:
                skipped[size] = str(error)
                continue
            predicted = fitted.predict(tested.feature)
            points.append(
                CurvePoint(
                    groups=size,
                    repeat=repeat,
                    recordings=min(len(rows.value), MODELS[model].most_recordings),
                    scores=metrics.score(tested.value, predicted, kind, period),
                    chance=metrics.chance(rows.value, tested.value, kind, period),
                    correct=_correct_by_grasp(predicted, tested, kind),
                )
            )
    if len(sizes) - len(skipped) < min(2, len(sizes)):
        text = "; ".join(f"{size} training groups per class: {skipped[size]}" for size in skipped)
        raise NotPossibleError(f"fewer than two points of the curve: {text}")
    return Curve(tuple(point for point in points if point.groups not in skipped), skipped)


def _fewest_groups(known: TaskData) -> int:
    """Return the number of groups of the class with the fewest.

    Raises NotPossibleError if a group has recordings of several classes.
    """
    counts = [len(np.unique(known.group[known.value == c])) for c in np.unique(known.value)]
    if sum(counts) > len(np.unique(known.group)):
        problem = "a group holds several classes: groups of one class cannot be counted"
        raise NotPossibleError(problem)
    return min(counts)


def _ordered_groups(
    classes: np.ndarray, group: np.ndarray, generator: np.random.Generator
) -> list[np.ndarray]:
    """Return the groups of each class in random order, from the class and group (n,) of rows."""
    return [generator.permutation(np.unique(group[classes == c])) for c in np.unique(classes)]


def _in_first_groups(orders: Sequence[np.ndarray], size: int, group: np.ndarray) -> np.ndarray:
    """Return which rows (n,) are of the first `size` groups of each class."""
    return np.isin(group, np.concatenate([order[:size] for order in orders]))


def _correct_by_grasp(predicted: np.ndarray, tests: TaskData, kind: Kind) -> dict[str, float]:
    """Return the share of correct predictions of each grasp; empty for a regression."""
    if kind == "regression":
        return {}
    is_correct = predicted == tests.value
    grasps = np.unique(tests.group)
    return {str(grasp): float(is_correct[tests.group == grasp].mean()) for grasp in grasps}


def grasps_needed(
    sizes: Sequence[int], correct: np.ndarray, reached: float, seed: int = 0
) -> tuple[float, Interval]:
    """Return the smallest of `sizes` with a mean accuracy of at least `reached`, and its interval.

    `correct` (sizes, draws, grasps) are shares of correct recordings, for each draw of training
    grasps and each validation grasp. The 95 % interval resamples draws and validation grasps. If no
    size reaches the accuracy, the result is infinity.

    >>> import numpy as np
    >>> from ajgdata.evaluate.few_grasps import grasps_needed
    >>> curve = np.array([0.4, 0.7, 0.9])[:, None, None] * np.ones((3, 5, 20))
    >>> grasps_needed([2, 4, 8], curve, 0.8)
    (8.0, Interval(low=8.0, high=8.0))
    """
    order = np.argsort(sizes)
    ascending = np.append(np.asarray(sizes, float)[order], np.inf)
    in_order = np.asarray(correct)[order]

    def first_size(accuracy: np.ndarray) -> np.ndarray:
        """Return the first size (n,) that reaches the accuracy, from accuracies (sizes, n)."""
        never = np.ones((1, accuracy.shape[1]), bool)
        is_enough = np.concatenate([accuracy >= reached - ROUNDING, never])
        return ascending[is_enough.argmax(axis=0)]

    needed = float(first_size(in_order.mean(axis=(1, 2))[:, None])[0])
    _, n_draws, n_grasps = in_order.shape
    if n_grasps < MIN_GRASPS:
        return needed, UNDEFINED
    random = np.random.default_rng(seed)
    draws = random.multinomial(n_draws, np.full(n_draws, 1 / n_draws), RESAMPLES) / n_draws
    grasps = random.multinomial(n_grasps, np.full(n_grasps, 1 / n_grasps), RESAMPLES) / n_grasps
    accuracy = np.einsum("sdg,nd,ng->sn", in_order, draws, grasps, optimize=True)
    resampled = first_size(accuracy)
    tail = 50 * (1 - CONFIDENCE)
    # interpolation between a number and infinity has no value: use the next resample outwards
    low = np.percentile(resampled, tail, method="lower")
    high = np.percentile(resampled, 100 - tail, method="higher")
    return needed, Interval(float(low), float(high))


@dataclass(frozen=True)
class CrossGripperPoint:
    """Scores on another gripper of a model that was also trained on some of its grasps.

    `grasps` groups of each class of the other gripper were added to the training rows. `scores` are
    on the groups of the other gripper in the test part of this fold, and `chance` are the scores of
    a guess for them. `own_scores` are the scores on the same groups of the model's own gripper.
    They are empty if it has no such groups, or if grasps were added.
    """

    grasps: int
    fold: int
    recordings: int  #: added recordings of the other gripper
    scores: dict[str, float]
    chance: dict[str, float]
    own_scores: dict[str, float]


def cross_gripper(
    own: TaskData,
    grippers: Mapping[str, TaskData],
    *,
    kind: Kind,
    model: str,
    sizes: Sequence[int],
    folds: int = 5,
    seed: int = 0,
    period: float | None = None,
) -> dict[str, list[CrossGripperPoint]]:
    """Return the scores on each of the other `grippers`, by its name.

    Each fold of a gripper is tested. The model is trained on `own`, and on `sizes` groups per class
    (per value of a regression) of the other gripper. Tested groups of both are excluded. Raises
    NotPossibleError if a class has too few groups for a size.
    """

    def fit(rows: TaskData) -> BaseEstimator:
        columns = (rows.feature, rows.value, rows.group)
        return fit_named_model(model, kind, *columns, seed=seed, period=period)

    @cache
    def fitted_on_own(tested: bytes) -> BaseEstimator:
        # Without added groups, grippers with the same tested groups share one training.
        return fit(own.where(~np.frombuffer(tested, bool)))

    def points_on(other: TaskData) -> Iterator[CrossGripperPoint]:
        for size, fold, added, tests in _calibrations(other, sizes, folds, seed):
            tested = np.isin(own.group, tests.group)
            known = own.where(~tested).joined(added)
            own_scores: dict[str, float] = {}
            if size:
                fitted = fit(known)
            else:
                fitted = fitted_on_own(tested.tobytes())
                if tested.any():
                    rows = own.where(tested)
                    predicted = fitted.predict(rows.feature)
                    own_scores = metrics.score(rows.value, predicted, kind, period)
            predicted = fitted.predict(tests.feature)
            yield CrossGripperPoint(
                grasps=size,
                fold=fold,
                recordings=len(added.value),
                scores=metrics.score(tests.value, predicted, kind, period),
                chance=metrics.chance(known.value, tests.value, kind, period),
                own_scores=own_scores,
            )

    with threadpool_limits(limits=1):
        return {name: list(points_on(other)) for name, other in grippers.items()}


def _calibrations(
    other: TaskData, sizes: Sequence[int], folds: int, seed: int
) -> Iterator[tuple[int, int, TaskData, TaskData]]:
    """Yield for each fold of a gripper and each size: size, fold, added rows and tested rows."""
    classes = other.value.astype(str)
    splits = grouped_folds(classes, other.group, "classification", folds, seed)
    for fold, (train, test) in enumerate(splits):
        pool = other.where(train)
        tests = other.where(test)
        orders = _ordered_groups(classes[train], pool.group, np.random.default_rng([seed, fold]))
        fewest = min(len(order) for order in orders)
        if max(sizes) > fewest:
            problem = f"{max(sizes)} calibration grasps: a class has {fewest} that are not tested"
            fix = "lower experiments.cross_gripper.grasps, or record more"
            raise NotPossibleError(f"{problem}; {fix}")
        for size in sizes:
            added = pool.where(_in_first_groups(orders, size, pool.group))
            yield size, fold, added, tests
