"""Errors of models that learn from few labelled grasps: learning curves, and another gripper."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
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


def _ordered_groups(
    class_of: np.ndarray, group: np.ndarray, generator: np.random.Generator
) -> list[np.ndarray]:
    """Return the groups of each class, in random order."""
    return [generator.permutation(np.unique(group[class_of == c])) for c in np.unique(class_of)]


def _first(orders: Sequence[np.ndarray], size: int, group: np.ndarray) -> np.ndarray:
    """Return which recordings (n,) are of the first `size` groups of each class."""
    return np.isin(group, np.concatenate([order[:size] for order in orders]))


@dataclass(frozen=True)
class CurvePoint:
    """One draw of training groups: `groups` of each class (of each value, for a regression)."""

    groups: int
    repeat: int
    recordings: int  #: that were learned from
    scores: dict[str, float]  #: on the validation rows, which all points share
    chance: dict[str, float]  #: the same of a guess that knows the training rows' targets only
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
    """Compute the errors for each number of training groups per class (`sizes`).

    All points are tested on the validation groups of the first fold. Each repeat draws an order of
    the training groups of each class and uses the first `size` groups; the model has the seed
    `seed` + repeat. Impossible sizes are skipped. Raises NotPossibleError for fewer than two
    possible sizes (of several), and for a group of several classes.
    """
    known, tested = map(data.where, grouped_folds(data.value, data.group, kind, folds, seed)[0])
    fewest = _fewest_groups(known)
    problem = f"a class has {fewest}; lower learning_curve.groups, or record more"
    skipped = dict.fromkeys((size for size in sizes if size > fewest), problem)
    fit = partial(fit_named_model, model, kind, period=period)
    points = []
    with threadpool_limits(limits=1):
        for repeat, size in product(range(repeats), sizes):
            if size in skipped:
                continue
            random = np.random.default_rng([seed, repeat])
            orders = _ordered_groups(known.value, known.group, random)
            rows = known.where(_first(orders, size, known.group))
            try:
                fitted = fit(rows.feature, rows.value, rows.group, seed=seed + repeat)
            except NotPossibleError as error:
                skipped[size] = str(error)
                continue
            used = min(len(rows.value), MODELS[model].most_recordings)
            predicted = fitted.predict(tested.feature)
            scores = _scores(predicted, rows.value, tested, kind, period)
            correct = _correct_by_grasp(predicted, tested) if kind == "classification" else {}
            points.append(CurvePoint(size, repeat, used, *scores, correct))
    return _checked_curve(points, sizes, skipped)


def _fewest_groups(known: TaskData) -> int:
    """Return the number of groups of the rarest class."""
    counts = [len(np.unique(known.group[known.value == c])) for c in np.unique(known.value)]
    if sum(counts) > len(np.unique(known.group)):
        problem = "a group holds several classes: groups of one class cannot be counted"
        raise NotPossibleError(problem)
    return min(counts)


def _checked_curve(
    points: Sequence[CurvePoint], sizes: Sequence[int], skipped: dict[int, str]
) -> Curve:
    if len(sizes) - len(skipped) < min(2, len(sizes)):
        text = "; ".join(f"{size} training groups per class: {skipped[size]}" for size in skipped)
        raise NotPossibleError(f"fewer than two points of the curve: {text}")
    return Curve(tuple(point for point in points if point.groups not in skipped), skipped)


def _scores(
    predicted: np.ndarray, y_train: np.ndarray, tests: TaskData, kind: Kind, period: float | None
) -> tuple[dict[str, float], dict[str, float]]:
    """Return the metrics of predictions for `tests`, and of a guess that ignores its input."""
    scores = metrics.score(tests.value, predicted, kind, period)
    return scores, metrics.chance(y_train, tests.value, kind, period)


def _correct_by_grasp(predicted: np.ndarray, tests: TaskData) -> dict[str, float]:
    """Return the share of correct predictions of each grasp."""
    is_correct = predicted == tests.value
    grasps = np.unique(tests.group)
    return {str(grasp): float(is_correct[tests.group == grasp].mean()) for grasp in grasps}


def grasps_needed(
    sizes: Sequence[int], correct: np.ndarray, reached: float, seed: int = 0
) -> tuple[float, Interval]:
    """Return the smallest of `sizes` with a mean accuracy of at least `reached`, and its interval.

    `correct` (sizes, draws, grasps) are shares of correct recordings. The interval resamples draws
    of training grasps and validation grasps. A curve that does not reach the accuracy needs
    infinitely many grasps.

    >>> import numpy as np
    >>> from ajgdata.evaluate.few_grasps import grasps_needed
    >>> curve = np.array([0.4, 0.7, 0.9])[:, None, None] * np.ones((3, 5, 20))
    >>> grasps_needed([2, 4, 8], curve, 0.8)
    (8.0, Interval(low=8.0, high=8.0))
    """
    order = np.argsort(sizes)
    ascending = np.append(np.asarray(sizes, float)[order], np.inf)
    correct = np.asarray(correct)[order]

    def first(accuracy: np.ndarray) -> np.ndarray:
        """Return the first size (n,) that reaches the accuracy, from accuracies (sizes, n)."""
        never = np.ones((1, accuracy.shape[1]), bool)
        is_enough = np.concatenate([accuracy >= reached - ROUNDING, never])
        return ascending[is_enough.argmax(axis=0)]

    needed = float(first(correct.mean(axis=(1, 2))[:, None])[0])
    _, n_draws, n_grasps = correct.shape
    if n_grasps < MIN_GRASPS:
        return needed, UNDEFINED
    random = np.random.default_rng(seed)
    draws = random.multinomial(n_draws, np.full(n_draws, 1 / n_draws), RESAMPLES) / n_draws
    grasps = random.multinomial(n_grasps, np.full(n_grasps, 1 / n_grasps), RESAMPLES) / n_grasps
    resampled = first(np.einsum("sdg,nd,ng->sn", correct, draws, grasps, optimize=True))
    tail = 50 * (1 - CONFIDENCE)
    # A percentile between a number and infinity has no value: take the resample next to it.
    low = np.percentile(resampled, tail, method="lower")
    high = np.percentile(resampled, 100 - tail, method="higher")
    return needed, Interval(float(low), float(high))


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
    """Return the errors on each other gripper in `grippers`, by its name.

    Each fold of a gripper is tested. A model is trained on `own` and on `sizes` other groups per
    class (per value of a regression) of that gripper, without the tested groups of both grippers.
    Without added groups, grippers with the same training rows of `own` share one training. Raises
    NotPossibleError if a class has too few groups for a size.
    """

    def fit(rows: TaskData) -> BaseEstimator:
        columns = (rows.feature, rows.value, rows.group)
        return fit_named_model(model, kind, *columns, seed=seed, period=period)

    @cache
    def fitted_on_own(tested: bytes) -> BaseEstimator:
        return fit(own.where(~np.frombuffer(tested, bool)))

    def points_on(other: TaskData) -> Iterator[CrossGripperPoint]:
        for size, fold, added, tests in _calibrations(other, sizes, folds, seed):
            tested = np.isin(own.group, tests.group)
            known = own.where(~tested).joined(added)
            fitted = fit(known) if size else fitted_on_own(tested.tobytes())
            home: dict[str, float] = {}
            if tested.any() and not size:
                at_home = own.where(tested)
                predicted = fitted.predict(at_home.feature)
                home, _ = _scores(predicted, known.value, at_home, kind, period)
            predicted = fitted.predict(tests.feature)
            scores = _scores(predicted, known.value, tests, kind, period)
            yield CrossGripperPoint(size, fold, len(added.value), *scores, home)

    with threadpool_limits(limits=1):
        return {name: list(points_on(other)) for name, other in grippers.items()}


def _calibrations(
    other: TaskData, sizes: Sequence[int], folds: int, seed: int
) -> Iterator[tuple[int, int, TaskData, TaskData]]:
    """Yield each size and fold of a gripper, with its calibration grasps and its tested rows."""
    classes = other.value.astype(str)
    splits = grouped_folds(classes, other.group, "classification", folds, seed)
    for fold, (train, test) in enumerate(splits):
        pool, tests = other.where(train), other.where(test)
        orders = _ordered_groups(classes[train], pool.group, np.random.default_rng([seed, fold]))
        count, fewest = max(sizes), min(map(len, orders))
        if count > fewest:
            problem = f"{count} calibration grasps: a class has {fewest} that are not tested"
            fix = "lower experiments.cross_gripper.grasps, or record more"
            raise NotPossibleError(f"{problem}; {fix}")
        for size in sizes:
            yield size, fold, pool.where(_first(orders, size, pool.group)), tests
