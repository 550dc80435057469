"""Cross-validation of one model on one task: errors, predictions, cost.

The three results are separate objects: `Scores` and `Predictions` are the same bytes for the same
inputs and seed; `Cost` is measured, so it differs between runs.

>>> import ajgdata
>>> from ajgdata.evaluate.crossval import cross_validate
>>> size = ajgdata.load_dataset("size").all("size")
>>> result = cross_validate(size.X, size.y, size.groups, kind="regression", model="knn", folds=4)
>>> result.scores.folds, sorted(result.scores.mean), result.predictions.y_pred.shape
(4, ['mae', 'r2', 'rmse'], (16,))
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from sklearn.base import BaseEstimator, clone
from sklearn.utils.validation import check_consistent_length, check_X_y
from threadpoolctl import threadpool_limits

from ajgdata.evaluate import metrics
from ajgdata.evaluate.agreement import Estimate, Interval
from ajgdata.evaluate.intervals import metric_interval
from ajgdata.evaluate.splits import check_folds, grouped_folds, random_folds
from ajgdata.evaluate.task_data import TaskData
from ajgdata.models import fit_model, make_model
from ajgdata.models.tuning import Folds
from ajgdata.types import MODELS, Kind, NotPossibleError

TIMED_PREDICTIONS = 5  # timed predictions; their median ignores one interruption or two
TIMING_BUDGET_S = 1.0  # stop repeating a slow prediction after this long


@dataclass(frozen=True)
class Scores:
    """Errors. Every dict maps a metric's name (see `metrics.METRICS`) to floats.

    `mean` and `sd` are over folds, each fold counting once; `sd` is the sample standard deviation
    (ddof = 1). A metric undefined in a fold (NaN) is undefined in the mean: `pooled`, from all
    out-of-fold predictions together, is then the one to read. `chance` is the mean over the same
    folds of a model that ignores its input. `classes` is empty for regression.

    Of extra rows, `folds` counts those that could predict some of them, and a row that several
    folds predicted counts as often in `pooled`.
    """

    split: str  #: "grouped" or "random", or the name of the extra rows
    kind: Kind
    period: float | None  #: of a target where y and y + period are equal
    folds: int
    recordings: int
    groups: int  #: distinct groups; for a random split the number of recordings
    per_fold: dict[str, tuple[float, ...]]
    mean: dict[str, float]
    sd: dict[str, float]
    pooled: dict[str, float]
    chance: dict[str, float]
    classes: tuple[Any, ...]


@dataclass(frozen=True, eq=False)
class Predictions:
    """Predictions, each by a model that never saw its group; arrays (n,).

    Out-of-fold predictions are in the order of the input, one for each row. Those of extra rows
    are in the order of the folds.
    """

    row: np.ndarray  #: number of the row in the input
    fold: np.ndarray
    y_true: np.ndarray
    y_pred: np.ndarray
    probability: np.ndarray | None  #: of the predicted class; None if the model has none


class Tested(NamedTuple):
    """Errors and predictions of a set of rows."""

    scores: Scores
    predictions: Predictions


@dataclass(frozen=True)
class Cost:
    """Times of a cross-validation, one thread, on whatever machine this was.

    `train_s` is wall time and `train_cpu_s` CPU time of fitting. The report shows the CPU time,
    because the wall time also depends on other programs. `inference_s_per_recording`: a whole test
    part predicted at once; `latency_s`: one recording predicted alone; both are wall times, the
    median over repeats, then over folds.
    """

    train_s: float
    train_cpu_s: float
    inference_s_per_recording: float
    latency_s: float


@dataclass(frozen=True)
class CrossValidation:
    """Result of `cross_validate`."""

    scores: Scores
    predictions: Predictions
    cost: Cost
    extra_tests: dict[str, Tested]
    #: Recordings that each fold's model learned from, and had; empty where it learned from all.
    thinned: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True)
class _Part:
    """Rows of one set that one fold predicted, with the targets that it was trained on."""

    fold: int
    row: np.ndarray
    y_train: np.ndarray
    y_pred: np.ndarray
    probability: np.ndarray | None


@dataclass(frozen=True)
class _Fold:
    """Result of one fold: predictions by name of the extra rows ("" for its own test part), the
    first four numbers of its `Cost`, and how many recordings it used, of how many."""

    parts: dict[str, _Part]
    cost: tuple[float, ...]
    used: tuple[int, int]


def cross_validate(
    features: np.ndarray,
    target: np.ndarray,
    groups: np.ndarray | Sequence | None,
    *,
    kind: Kind,
    model: str | BaseEstimator,
    folds: int | Folds = 5,
    seed: int = 0,
    period: float | None = None,
    extra_tests: Mapping[str, TaskData] | None = None,
    grasps: np.ndarray | Sequence | None = None,
) -> CrossValidation:
    """Cross-validate a model: each fold is predicted by a model trained on the other folds.

    `features` (n, n_features); `target` (n,) numbers or class labels; `groups` (n,) labels, e.g.
    grasps, whose recordings are never in both parts of a fold. None ignores groups, which is
    optimistic if recordings of one grasp are alike.

    `folds` is a number of folds (see `grouped_folds` and `random_folds`, which use `seed`), or the
    pairs (train, test) of row numbers that a function of `splits` returns. `model` is a name of
    `docs/models.md`, or an unfitted scikit-learn estimator. A named model that is tuned chooses its
    settings by inner folds that keep groups whole, or `grasps` (n,) if the training part is of one
    group. BLAS and OpenMP get one thread: results do not depend on the number of cores.

    With a `period`, the targets y and y + `period` are equal. Each fold also predicts the rows of
    `extra_tests` whose group is not in its training part.

    Raises ValueError for missing values, lengths that differ, folds that are not possible or
    divide a group, and extra rows without `groups`.

    >>> import ajgdata
    >>> import numpy as np
    >>> label, grasp = np.repeat(["ball", "cube"], 20), np.arange(40) // 2  # 2 recordings each
    >>> features = np.arange(40.0)[:, None]  # balls: below 20
    >>> model = {"kind": "classification", "model": "knn_plain"}
    >>> result = ajgdata.cross_validate(features, label, grasp, folds=5, **model)
    >>> result.scores.mean["accuracy"], result.scores.sd["accuracy"], result.scores.groups
    (1.0, 0.0, 20)
    """
    group = np.arange(len(target)) if groups is None else np.asarray(groups)
    own = TaskData(*_validated(features, target, kind), group, group)
    inner = group if grasps is None else np.asarray(grasps)
    tests = _checked_tests(extra_tests or {}, kind, own, is_grouped=groups is not None)
    if not isinstance(folds, int):
        pairs = list(folds)
    elif groups is None:
        pairs = random_folds(own.value, kind, folds, seed)
    else:
        pairs = grouped_folds(own.value, group, kind, folds, seed)
    check_folds(pairs, group)
    split = "random" if groups is None else "grouped"
    unfitted, limit = model, None
    if isinstance(model, str):
        unfitted, limit = make_model(model, kind, seed, period), MODELS[model].most_recordings
    with threadpool_limits(limits=1):
        results = [
            _run(n, *pair, own, inner, tests, unfitted, limit) for n, pair in enumerate(pairs)
        ]
    return _collected(results, own, tests, kind, period, split)


def _run(
    number: int,
    train: np.ndarray,
    test: np.ndarray,
    own: TaskData,
    inner: np.ndarray,
    tests: Mapping[str, TaskData],
    model: BaseEstimator,
    limit: int | None,
) -> _Fold:
    """Train a fold's model, and predict its test part and the extra rows of unknown groups."""
    is_divided = len(np.unique(own.group[train])) > 1
    divided = own if is_divided else own._replace(group=inner)
    fitted, cost = _fitted(model, divided, train, test, limit)
    y_train = own.value[train]
    parts = {"": _predict(fitted, own.feature, test, number, y_train)}
    for name, rows in tests.items():
        new = np.flatnonzero(~np.isin(rows.group, own.group[train]))
        if len(new):
            parts[name] = _predict(fitted, rows.feature, new, number, y_train)
    return _Fold(parts, cost, (min(len(train), limit or len(train)), len(train)))


def _collected(
    folds: Sequence[_Fold],
    own: TaskData,
    tests: Mapping[str, TaskData],
    kind: Kind,
    period: float | None,
    split: str,
) -> CrossValidation:
    """Return the result of all folds."""
    tested = {}
    for name, rows in {"": own, **tests}.items():
        parts = [fold.parts[name] for fold in folds if name in fold.parts]
        scores = _scores(rows, parts, kind, period, name or split)
        tested[name] = Tested(scores, _predictions(rows, parts, in_order=not name))
    scores, predictions = tested.pop("")
    used = tuple(fold.used for fold in folds)
    thinned = used if any(some < every for some, every in used) else ()
    wall, cpu, together, alone = zip(*(fold.cost for fold in folds), strict=True)
    cost = Cost(sum(wall), sum(cpu), statistics.median(together), statistics.median(alone))
    return CrossValidation(scores, predictions, cost, tested, thinned)


def _validated(
    features: np.ndarray, target: np.ndarray, kind: Kind
) -> tuple[np.ndarray, np.ndarray]:
    features, target = check_X_y(features, target, dtype=None)
    return features, target.astype(np.float64) if kind == "regression" else target


def _checked_tests(
    extra_tests: Mapping[str, TaskData], kind: Kind, own: TaskData, *, is_grouped: bool
) -> dict[str, TaskData]:
    """Return the sets as arrays. Raises ValueError for a set that cannot be tested on."""
    checked, width = {}, own.feature.shape[1]
    for name, tests in extra_tests.items():
        if not len(tests.value):
            raise NotPossibleError(f"{name}: no recording is left to test on")
        features, target = _validated(tests.feature, tests.value, kind)
        check_consistent_length(target, tests.group)
        if features.shape[1] != width:
            widths = f"{features.shape[1]} features, not {width}"
            raise ValueError(f"{name} has {widths}: give both data sets the same feature settings")
        checked[name] = TaskData(features, target, np.asarray(tests.group), tests.name)
    if checked and not is_grouped:
        raise ValueError("extra rows need groups, or a grasp could be trained and tested on")
    return checked


def _fitted(
    model: BaseEstimator, rows: TaskData, train: np.ndarray, test: np.ndarray, limit: int | None
) -> tuple[Any, tuple[float, ...]]:
    """Return a model trained on the rows `train`, and the first four numbers of its `Cost`, with
    predictions timed on `test`."""
    unfitted = clone(model)
    wall, cpu = time.perf_counter(), time.process_time()
    known = rows.where(train)
    estimator = fit_model(unfitted, known.feature, known.value, known.group, limit)
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    tested, single = rows.feature[test], rows.feature[test[:1]]
    estimator.predict(tested)  # once untimed: the first call may load something
    together, alone = (_predicting_s(estimator, x) for x in (tested, single))
    return estimator, (wall, cpu, together / len(tested), alone)


def _predicting_s(estimator: Any, rows: np.ndarray) -> float:
    """Return the median wall time of some predictions of the rows, in s."""
    times: list[float] = []
    while len(times) < TIMED_PREDICTIONS and sum(times) < TIMING_BUDGET_S:
        start = time.perf_counter()
        estimator.predict(rows)
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def _predict(
    fitted: Any, features: np.ndarray, rows: np.ndarray, fold: int, y_train: np.ndarray
) -> _Part:
    y_pred, probability = fitted.predict(features[rows]), None
    if hasattr(fitted, "predict_proba"):
        probability = fitted.predict_proba(features[rows]).max(axis=1)
    return _Part(fold, rows, y_train, y_pred, probability)


def _predictions(tests: TaskData, parts: Sequence[_Part], *, in_order: bool) -> Predictions:
    """Return the folds' predictions together; `in_order`: put back into the order of the rows."""
    row = np.concatenate([part.row for part in parts])
    fold = np.repeat([part.fold for part in parts], [len(part.row) for part in parts])
    y_pred = np.concatenate([part.y_pred for part in parts])
    probabilities = [part.probability for part in parts if part.probability is not None]
    order = np.argsort(row) if in_order else np.arange(len(row))
    return Predictions(
        row=row[order],
        fold=fold[order],
        y_true=tests.value[row[order]],
        y_pred=y_pred[order],
        probability=np.concatenate(probabilities)[order] if probabilities else None,
    )


def _scores(
    tests: TaskData, parts: Sequence[_Part], kind: Kind, period: float | None, split: str
) -> Scores:
    if not parts:
        raise NotPossibleError(f"{split}: every one of its groups is trained on in every fold")
    y = tests.value
    each = [metrics.score(y[p.row], p.y_pred, kind, period) for p in parts]
    chance = [metrics.chance(p.y_train, y[p.row], kind, period) for p in parts]
    names = metrics.METRICS[kind]
    per_fold = {name: tuple(fold[name] for fold in each) for name in names}
    y_true = y[np.concatenate([p.row for p in parts])]
    y_pred = np.concatenate([p.y_pred for p in parts])
    classes = np.unique(np.concatenate([y, *(p.y_train for p in parts)]))
    return Scores(
        split=split,
        kind=kind,
        period=period,
        folds=len(parts),
        recordings=len(y),
        groups=len(np.unique(tests.group)),
        per_fold=per_fold,
        mean={name: float(np.mean(values)) for name, values in per_fold.items()},
        sd={name: deviation(values) for name, values in per_fold.items()},
        pooled=metrics.score(y_true, y_pred, kind, period),
        chance={name: float(np.mean([fold[name] for fold in chance])) for name in names},
        classes=tuple(classes.tolist()) if kind == "classification" else (),
    )


def estimate_score(
    result: CrossValidation | Tested, grasps: np.ndarray | Sequence, *, seed: int = 0
) -> Estimate:
    """Return accuracy or RMSE, the mean over folds, with its 95 % interval over grasps.

    `grasps` (n,) are those of the rows of the input (of a `Tested`: of its extra rows). A larger
    unit, e.g. the placement, gives the interval over this unit. See `intervals.metric_interval`,
    which uses `seed`. The chance level is that of `Scores.chance`.

    Raises ValueError unless there is a grasp per row.

    >>> import ajgdata
    >>> import numpy as np
    >>> label, grasp = np.repeat(["ball", "cube"], 20), np.arange(40) // 2  # 2 recordings each
    >>> features = np.arange(40.0)[:, None]  # balls: below 20
    >>> model = {"kind": "classification", "model": "knn_plain"}
    >>> result = ajgdata.cross_validate(features, label, grasp, **model)
    >>> accuracy = ajgdata.estimate_score(result, grasp)
    >>> accuracy.value, accuracy.interval.high, accuracy.chance
    (1.0, 1.0, 0.5)
    >>> f"{accuracy.interval.low:.3f}"  # 20 of 20 grasps are right: 0.025 ** (1 / 20)
    '0.832'
    """
    scores, predictions = result.scores, result.predictions
    grasp = np.asarray(grasps)
    if len(grasp) != scores.recordings:
        raise ValueError(f"{len(grasp)} grasps but {scores.recordings} recordings")
    interval = metric_interval(
        predictions.y_true,
        predictions.y_pred,
        predictions.fold,
        grasp[predictions.row],
        kind=scores.kind,
        period=scores.period,
        seed=seed,
    )
    metric = metrics.METRICS[scores.kind][0]
    perfect = metrics.perfect_value(metric)
    return Estimate(scores.mean[metric], interval, scores.chance[metric], perfect)


def deviation(values: Sequence[float]) -> float:
    """Return the sample standard deviation (ddof = 1), NaN for a single value."""
    return float(np.std(values, ddof=1)) if len(values) > 1 else float("nan")


def overall(
    known: Predictions, withheld: Predictions, period: float | None = None
) -> dict[str, tuple[float, ...]]:
    """Return metrics of known and withheld recordings together, one value per fold.

    A fold tests a part of the known recordings, but all withheld ones. The weights make the known
    ones count as often as there are of them: each recording of the data set counts once.
    """
    per_fold = []
    for fold in np.unique(known.fold):
        test, new = known.fold == fold, withheld.fold == fold
        weight = np.concatenate(
            [np.full(test.sum(), len(known.fold) / test.sum()), np.ones(new.sum())]
        )
        y_true = np.concatenate([known.y_true[test], withheld.y_true[new]])
        y_pred = np.concatenate([known.y_pred[test], withheld.y_pred[new]])
        per_fold.append(metrics.regression(y_true, y_pred, period, weight))
    return {name: tuple(fold[name] for fold in per_fold) for name in metrics.METRICS["regression"]}


def overall_chance(
    known: Predictions, withheld: Predictions, period: float | None = None
) -> dict[str, tuple[float, ...]]:
    """Return the metrics of `overall` for a guess: the mean of a fold's training recordings."""
    middle = {
        fold: metrics.middle(known.y_true[known.fold != fold], period)
        for fold in np.unique(known.fold)
    }

    def guess(part: Predictions) -> Predictions:
        return replace(part, y_pred=np.array([middle[fold] for fold in part.fold]))

    return overall(guess(known), guess(withheld), period)


def overall_interval(
    known: Predictions,
    withheld: Predictions,
    known_grasps: np.ndarray,
    withheld_grasps: np.ndarray,
    *,
    period: float | None = None,
    seed: int = 0,
) -> Interval:
    """Return the 95 % interval over grasps of the mean RMSE over folds of `overall`.

    The grasps (n,) are those of the rows that each set of predictions counts.
    """
    return metric_interval(
        np.concatenate([known.y_true, withheld.y_true]),
        np.concatenate([known.y_pred, withheld.y_pred]),
        np.concatenate([known.fold, withheld.fold]),
        np.concatenate([known_grasps[known.row], withheld_grasps[withheld.row]]),
        kind="regression",
        period=period,
        part=np.repeat([0, 1], [len(known.row), len(withheld.row)]),
        seed=seed,
    )
