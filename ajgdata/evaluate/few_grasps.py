"""What a few labelled grasps are worth: learning curves, another gripper, a new session.

A gripper that was moved, warmed or refilled shifts and scales the bins of all its spectra.
Corrections use recordings of the new session, without or with labels, to undo that change.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from sklearn.base import BaseEstimator
from threadpoolctl import threadpool_limits

from ajgdata.evaluate import metrics
from ajgdata.evaluate.splits import grouped_folds
from ajgdata.evaluate.task_data import TaskData
from ajgdata.models import fit_named_model, most_recordings
from ajgdata.types import Kind, NotPossibleError

NONE, STANDARDISED = "as it is", "standardised"
#: Spectra are compressed by asinh from this share of their mean on, as in the linear models.
RELATIVE = 0.1
#: A bin whose deviation is smaller does not vary: float32 rounds it away.
STILL = 1e-6
Row = dict[str, Any]
#: Features (n, f) to train on and (m, f) to test.
Corrected = tuple[np.ndarray, np.ndarray]


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


@dataclass(frozen=True)
class Curve:
    """The points of all sizes that could be learned from, and why not of the `others`."""

    points: tuple[CurvePoint, ...]
    others: dict[int, str]


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
    limits: Mapping[str, int] | None = None,
) -> Curve:
    """Train on ever more groups per class, and test always on the same: those of the first fold.

    Each repeat draws an order of every class's training groups and takes the first of them; its
    seed is the model's as well. Impossible sizes are skipped. Raises NotPossibleError for fewer
    than two possible sizes (of several), and for a group of several classes.
    """
    known, tested = map(data.where, grouped_folds(data.value, data.group, kind, folds, seed)[0])
    fewest = _fewest_groups(known)
    problem = f"a class has {fewest}; lower learning_curve.groups, or record more"
    others = dict.fromkeys((size for size in sizes if size > fewest), problem)
    fit = partial(fit_named_model, model, kind, period=period, limits=limits)
    points = []
    with threadpool_limits(limits=1):
        for repeat, size in product(range(repeats), sizes):
            if size in others:
                continue
            random = np.random.default_rng([seed, repeat])
            orders = _ordered_groups(known.value, known.group, random)
            rows = known.where(_first(orders, size, known.group))
            try:
                fitted = fit(rows.feature, rows.value, rows.group, seed=seed + repeat)
            except NotPossibleError as error:
                others[size] = str(error)
                continue
            used = min(len(rows.value), most_recordings(model, limits or {}) or len(rows.value))
            scores = _scores(fitted, rows.value, tested, kind, period)
            points.append(CurvePoint(size, repeat, used, *scores))
    return _checked_curve(points, sizes, others)


def _fewest_groups(known: TaskData) -> int:
    """Return the number of groups of the rarest class."""
    counts = [len(np.unique(known.group[known.value == c])) for c in np.unique(known.value)]
    if sum(counts) > len(np.unique(known.group)):
        problem = "a group holds several classes: groups of one class cannot be counted"
        raise NotPossibleError(problem)
    return min(counts)


def _checked_curve(
    points: Sequence[CurvePoint], sizes: Sequence[int], others: dict[int, str]
) -> Curve:
    if len(sizes) - len(others) < min(2, len(sizes)):
        text = "; ".join(f"{size} training groups per class: {others[size]}" for size in others)
        raise NotPossibleError(f"fewer than two points of the curve: {text}")
    return Curve(tuple(point for point in points if point.groups not in others), others)


def _scores(
    fitted: BaseEstimator, y_train: np.ndarray, tests: TaskData, kind: Kind, period: float | None
) -> tuple[dict[str, float], dict[str, float]]:
    """Return the metrics of a fitted model on `tests`, and of a guess that ignores its input."""
    scores = metrics.score(tests.value, fitted.predict(tests.feature), kind, period)
    return scores, metrics.chance(y_train, tests.value, kind, period)


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
    other: TaskData,
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

    Groups that are tested are trained on in neither gripper. Raises NotPossibleError for a size
    that some class has too few groups for.
    """
    fit = partial(fit_named_model, model, kind, seed=seed, period=period, limits=limits)
    classes, points = other.value.astype(str), []
    with threadpool_limits(limits=1):
        splits = grouped_folds(classes, other.group, "classification", folds, seed)
        for fold, (train, test) in enumerate(splits):
            pool, tests = other.where(train), other.where(test)
            tested = np.isin(own.group, tests.group)
            generator = np.random.default_rng([seed, fold])
            orders = _ordered_groups(classes[train], pool.group, generator)
            _refuse_few(orders, max(sizes))
            for size in sizes:
                added = pool.where(_first(orders, size, pool.group))
                known = own.where(~tested).joined(added)
                fitted = fit(known.feature, known.value, known.group)
                home: dict[str, float] = {}
                if tested.any() and not size:
                    home = _scores(fitted, known.value, own.where(tested), kind, period)[0]
                scores = _scores(fitted, known.value, tests, kind, period)
                points.append(CrossGripperPoint(size, fold, len(added.value), *scores, home))
    return points


def _refuse_few(orders: Sequence[np.ndarray], most: int) -> None:
    if most > (fewest := min(map(len, orders))):
        problem = f"{most} calibration grasps: a class has {fewest} that are not tested"
        raise NotPossibleError(f"{problem}; lower calibrate.grasps, or record more")


def on_new_sessions(
    data: TaskData,
    sessions: np.ndarray,
    *,
    tested: Sequence[str],
    train_on: Sequence[str],
    sizes: Sequence[int],
    draws: int,
    model: str,
    kind: Kind,
    seed: int,
    period: float | None = None,
    limits: Mapping[str, int] | None = None,
) -> Iterator[Row]:
    """Yield one row per session of `tested`, draw, correction and metric; `sessions` (n,).

    Models are trained on the sessions `train_on` (none: all others). Each draw sets `max(sizes)`
    groups of each class (each value, of a number) aside for corrections; the rest is tested, and
    trained on in no session. Sizes for which a class has too few groups are skipped; if none is
    possible, half of the groups are set aside, unlabelled. `labelled` and `unlabelled` are counts
    of recordings of the new session.
    """
    fit = partial(fit_named_model, model, kind, seed=seed, period=period, limits=limits)
    with threadpool_limits(limits=1):
        for session, draw in product(tested, range(draws)):
            there = data.where(sessions == session)
            others = np.isin(sessions, train_on) if train_on else sessions != session
            aside, labelled = _set_aside(there, sizes, np.random.default_rng([seed, draw]))
            trained = others & (sessions != session) & ~np.isin(data.group, there.group[~aside])
            known = data.where(trained)
            if len(np.unique(known.value)) < 2 or aside.all() or not aside.any():
                problem = "too little is left to train on or to test"
                raise NotPossibleError(f"session {str(session)!r}: {problem}")
            run = partial(_rows, known, there.where(~aside), fit, kind, period)
            for row in _corrections(run, known, sessions[trained], there, aside, labelled):
                yield {"session": str(session), "draw": draw, **row}


def _corrections(
    run: Callable[..., Iterator[Row]],
    known: TaskData,
    sessions: np.ndarray,
    there: TaskData,
    aside: np.ndarray,
    labelled: Mapping[int, np.ndarray],
) -> Iterator[Row]:
    """Yield the metrics of each correction in one session; `sessions` (n,) are of `known`."""
    pool, tested = there.feature[aside], there.feature[~aside]
    plain = known.feature, tested
    yield from run(NONE, plain)
    corrected = standardised(known.feature, sessions, pool, tested)
    yield from run(STANDARDISED, corrected, unlabelled=len(pool))
    for grasps, chosen in labelled.items():
        name = f"{grasps} grasp{'s' * (grasps > 1)} of each"
        yield from run(name, plain, there.where(chosen), labelled=int(chosen.sum()))


def _set_aside(
    there: TaskData, sizes: Sequence[int], generator: np.random.Generator
) -> tuple[np.ndarray, dict[int, np.ndarray]]:
    """Return which recordings (n,) are set aside, and which of these each size labels."""
    orders = _ordered_groups(there.value.astype(str), there.group, generator)
    possible = [size for size in sizes if size < min(map(len, orders))]
    if not possible:
        every = generator.permutation(np.unique(there.group))
        return np.isin(there.group, every[: len(every) // 2]), {}
    labelled = {size: _first(orders, size, there.group) for size in possible}
    return labelled[max(possible)], labelled


def _rows(
    known: TaskData,
    tests: TaskData,
    fit: Callable[..., BaseEstimator],
    kind: Kind,
    period: float | None,
    name: str,
    corrected: Corrected,
    added: TaskData | None = None,
    **used: int,
) -> Iterator[Row]:
    """Yield the metrics of one correction in one session; `added` recordings are trained on."""
    rows = known._replace(feature=corrected[0])
    if added is not None:
        rows = rows.joined(added)
    fitted = fit(rows.feature, rows.value, rows.group)
    tested = tests._replace(feature=corrected[1])
    scores, chance = _scores(fitted, rows.value, tested, kind, period)
    counts = dict.fromkeys(("labelled", "unlabelled"), 0) | used
    for metric, value in scores.items():
        row = {"remedy": name, **counts, "metric": metric}
        yield row | {"value": value, "chance": chance[metric]}


def standardised(
    known: np.ndarray, sessions: np.ndarray, unlabelled: np.ndarray, new: np.ndarray
) -> Corrected:
    """Give each bin the same mean and deviation in every session: the mean of those of known ones.

    `known` (n, f) of `sessions` (n,); `unlabelled` (u, f) are recordings of the new session, from
    which its own mean and deviation are computed; `new` (m, f) is tested. Spectra are compressed by
    asinh, so a gain is a shift. This assumes that classes are equally frequent in all sessions.
    """
    scale = float(np.abs(known).mean() * RELATIVE) or 1.0

    def compressed(features: np.ndarray) -> np.ndarray:
        return np.arcsinh(np.asarray(features, np.float64) / scale)

    values = compressed(known)
    moments = {name: _moments(values[sessions == name]) for name in np.unique(sessions)}
    mean, sd = np.mean(list(moments.values()), axis=0)

    def restored(points: np.ndarray, own: np.ndarray) -> np.ndarray:
        """Return features of standardised bins; no magnitude is below 0."""
        z = (points - own[0]) / own[1]
        return (scale * np.sinh(np.maximum(z * sd + mean, 0.0))).astype(np.float32)

    corrected = np.empty(values.shape, np.float32)
    for name, own in moments.items():
        corrected[sessions == name] = restored(values[sessions == name], own)
    return corrected, restored(compressed(new), _moments(compressed(unlabelled)))


def _moments(values: np.ndarray) -> np.ndarray:
    """Return mean and deviation (2, f); a bin that does not vary, or of one recording, counts 1."""
    sd = values.std(axis=0, ddof=1) if len(values) > 1 else np.ones(values.shape[1])
    return np.array([values.mean(axis=0), np.where(sd > STILL, sd, 1.0)])
