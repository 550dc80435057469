"""Cross-validation of one model on one task: errors, predictions, cost.

`Scores` and `Predictions` are the same bytes for the same input and seed. `Cost` is measured, so it
differs between runs.

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
from collections.abc import Iterable, Mapping, Sequence
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
from ajgdata.evaluate.task_data import TaskData, TrainingCopies, training_part
from ajgdata.models import fit_model, make_model, number_of_axes
from ajgdata.models.tuning import Folds
from ajgdata.types import MODELS, Kind, NotPossibleError
from ajgdata.types.input_layout import InputLayout

#: Number of timed predictions. Their median ignores one or two interruptions.
TIMED_PREDICTIONS = 5
#: Time (s) after which a slow prediction is not repeated again.
TIMING_BUDGET_S = 1.0


@dataclass(frozen=True)
class Scores:
    """Metrics of predictions: by fold, their mean and spread, and those of a guess.

    Each dict maps the name of a metric (see `metrics.METRICS`) to its value. `mean` and `sd` are
    over folds, each with equal weight; `sd` is the sample standard deviation (ddof = 1). `pooled`
    is computed from the predictions of all folds together. If a metric is undefined in a fold
    (NaN), so is its mean; use `pooled` instead. `chance` is the mean over folds of a model that
    ignores its input. `classes` is empty for a regression.

    Scores of extra rows: `folds` counts the folds that predicted some of the rows, and a row that
    several folds predicted counts as often in `pooled`.
    """

    split: str  #: "grouped" or "random", or the name of the extra rows
    kind: Kind
    period: float | None  #: the targets y and y + period are equal
    folds: int
    recordings: int
    groups: int  #: distinct groups; for a random split the number of recordings
    per_fold: dict[str, tuple[float, ...]]
    mean: dict[str, float]
    sd: dict[str, float]
    pooled: dict[str, float]
    chance: dict[str, float]
    classes: tuple[Any, ...]
    axes: tuple[Scores, ...] = ()  #: scores of each axis of a vector


@dataclass(frozen=True, eq=False)
class Predictions:
    """Predictions (n,), each by a model that was not trained on the group of the recording.

    Truth and prediction of a vector are (n, k).

    Out-of-fold predictions are in the order of the input, one for each row. Predictions of extra
    rows are in the order of the folds.
    """

    row: np.ndarray  #: number of the row in the input
    fold: np.ndarray
    y_true: np.ndarray
    y_pred: np.ndarray
    probability: np.ndarray | None  #: of the predicted class; None if the model has none

    def axis(self, number: int) -> Predictions:
        """Return the predictions of one axis of a vector."""
        y_true = self.y_true[:, number]
        return replace(self, y_true=y_true, y_pred=self.y_pred[:, number])


class Tested(NamedTuple):
    """Scores and predictions of a set of rows."""

    scores: Scores
    predictions: Predictions


@dataclass(frozen=True)
class Cost:
    """Times (s) of a cross-validation with one thread, on the computer that ran it.

    `train_s` is the wall time of training, and `train_cpu_s` its CPU time. The report shows the CPU
    time, because the wall time also depends on other programs. `inference_s_per_recording` is the
    wall time of the prediction of a complete test part, divided by its recordings. `latency_s` is
    the wall time of the prediction of one recording. Both are medians over repeats, then over
    folds.
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
    #: Numbers of recordings and copies by fold: those that the model was trained on, and all of the
    #: training part. Empty if each model was trained on its complete training part.
    thinned: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True)
class _Part:
    """Rows that one fold predicted, with the targets that its model was trained on."""

    fold: int
    row: np.ndarray
    y_train: np.ndarray
    y_pred: np.ndarray
    probability: np.ndarray | None


@dataclass(frozen=True)
class _Fold:
    """Predictions of one fold for its test part and for the extra rows, and their cost."""

    test: _Part
    extra_tests: dict[str, _Part]
    cost: Cost
    #: recordings and copies that the model was trained on, and all of the training part
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
    copies: TrainingCopies | None = None,
    layout: InputLayout | None = None,
) -> CrossValidation:
    """Cross-validate a model: each fold is predicted by a model trained on the other folds.

    `features` (n, n_features); `target` (n,) numbers or class labels, or (n, k) vectors of numbers.
    `groups` (n,) are labels, e.g. of grasps: the recordings of a group are never in both parts of a
    fold. With None, groups are ignored, which gives optimistic scores if recordings of one grasp
    are similar.

    `folds` is a number of folds (see `grouped_folds` and `random_folds`, which use `seed`), or the
    pairs (train, test) of row numbers that a function of `splits` returns. `model` is a name of
    `docs/models.md`, or an unfitted scikit-learn estimator. A tuned model chooses its settings by
    inner folds, which keep the groups of the training part together; if it has only one group, they
    keep `grasps` (n,) together. BLAS and OpenMP have one thread, so results do not depend on the
    number of cores.

    Each model is also trained on those `copies` whose recording is in its training part; no copy is
    tested. With a `period`, the targets y and y + `period` are equal. Each fold also predicts the
    rows of `extra_tests` whose group is not in its training part. `layout` states the dimensions
    and covariates in `features`, for models that take them (see `models.make_model`).

    Raises ValueError for missing values, different lengths, folds that are not possible or divide
    a group, and extra rows without `groups`.

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
    features, target = _validated(features, target, kind)
    own = TaskData(features, target, group, name=group)
    tests = _checked_tests(extra_tests or {}, kind, own, is_grouped=groups is not None)
    if isinstance(folds, Iterable):
        pairs = list(folds)
    elif groups is None:
        pairs = random_folds(own.value, kind, int(folds), seed)
    else:
        pairs = grouped_folds(own.value, group, kind, int(folds), seed)
    check_folds(pairs, group)
    unfitted = model
    limit = None
    if isinstance(model, str):
        unfitted = make_model(model, kind, seed, period, number_of_axes(target), layout)
        limit = MODELS[model].most_recordings
    inner_group = group if grasps is None else np.asarray(grasps)
    with threadpool_limits(limits=1):
        results = [
            _run_fold(number, train, test, own, inner_group, tests, unfitted, limit, copies)
            for number, (train, test) in enumerate(pairs)
        ]
    split = "random" if groups is None else "grouped"
    return _collected(results, own, tests, kind, period, split)


def _validated(
    features: np.ndarray, target: np.ndarray, kind: Kind
) -> tuple[np.ndarray, np.ndarray]:
    """Return features (n, f) and target (n,) as arrays; the target of a regression as float64."""
    is_vector = kind == "regression" and np.ndim(target) > 1
    features, target = check_X_y(features, target, dtype=None, multi_output=is_vector)
    return features, target.astype(np.float64) if kind == "regression" else target


def _checked_tests(
    extra_tests: Mapping[str, TaskData], kind: Kind, own: TaskData, *, is_grouped: bool
) -> dict[str, TaskData]:
    """Return the extra rows as arrays. Raises ValueError for rows that cannot be tested on."""
    checked = {}
    width = own.feature.shape[1]
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


def _run_fold(
    number: int,
    train: np.ndarray,
    test: np.ndarray,
    own: TaskData,
    inner_group: np.ndarray,
    tests: Mapping[str, TaskData],
    model: BaseEstimator,
    limit: int | None,
    copies: TrainingCopies | None,
) -> _Fold:
    """Train a model on a fold, and predict its test part and the extra rows of other groups.

    `inner_group` (n,) divides the training part if it consists of one group.
    """
    known = training_part(own, train, copies)
    if len(np.unique(known.group)) == 1:
        known = training_part(own._replace(group=inner_group), train, copies)
    unfitted = clone(model)
    wall_start = time.perf_counter()
    cpu_start = time.process_time()
    fitted = fit_model(unfitted, known.feature, known.value, known.group, limit)
    train_s = time.perf_counter() - wall_start
    train_cpu_s = time.process_time() - cpu_start
    tested = own.feature[test]
    fitted.predict(tested)  # not timed, because the first call may load something
    cost = Cost(
        train_s=train_s,
        train_cpu_s=train_cpu_s,
        inference_s_per_recording=_prediction_s(fitted, tested) / len(tested),
        latency_s=_prediction_s(fitted, tested[:1]),
    )
    own_part = _predict(fitted, own.feature, test, number, known.value)
    parts = {}
    for name, rows in tests.items():
        new = np.flatnonzero(~np.isin(rows.group, own.group[train]))
        if len(new):
            parts[name] = _predict(fitted, rows.feature, new, number, known.value)
    available = len(known.value)
    used = available if limit is None else min(available, limit)
    return _Fold(own_part, parts, cost, (used, available))


def _prediction_s(estimator: Any, features: np.ndarray) -> float:
    """Return the median wall time of a prediction of all features (m, f), in s."""
    times: list[float] = []
    while len(times) < TIMED_PREDICTIONS and sum(times) < TIMING_BUDGET_S:
        start = time.perf_counter()
        estimator.predict(features)
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def _predict(
    fitted: Any, features: np.ndarray, rows: np.ndarray, fold: int, y_train: np.ndarray
) -> _Part:
    """Return the predictions of a fitted model for some rows of the features."""
    y_pred = fitted.predict(features[rows])
    probability = None
    if hasattr(fitted, "predict_proba"):
        probability = fitted.predict_proba(features[rows]).max(axis=1)
    return _Part(fold, rows, y_train, y_pred, probability)


def _collected(
    folds: Sequence[_Fold],
    own: TaskData,
    tests: Mapping[str, TaskData],
    kind: Kind,
    period: float | None,
    split: str,
) -> CrossValidation:
    """Return the result of all folds."""
    own_parts = [fold.test for fold in folds]
    scores = _scores(own, own_parts, kind, period, split)
    predictions = _predictions(own, own_parts, in_input_order=True)
    extra_tests = {}
    for name, rows in tests.items():
        parts = [fold.extra_tests[name] for fold in folds if name in fold.extra_tests]
        if not parts:
            raise NotPossibleError(f"{name}: every one of its groups is trained on in every fold")
        extra_scores = _scores(rows, parts, kind, period, name)
        extra_tests[name] = Tested(extra_scores, _predictions(rows, parts, in_input_order=False))
    costs = [fold.cost for fold in folds]
    cost = Cost(
        train_s=sum(item.train_s for item in costs),
        train_cpu_s=sum(item.train_cpu_s for item in costs),
        inference_s_per_recording=statistics.median(c.inference_s_per_recording for c in costs),
        latency_s=statistics.median(item.latency_s for item in costs),
    )
    thinned = tuple(fold.used for fold in folds)
    if all(used == available for used, available in thinned):
        thinned = ()
    return CrossValidation(scores, predictions, cost, extra_tests, thinned)


def _scores(
    tests: TaskData, parts: Sequence[_Part], kind: Kind, period: float | None, split: str
) -> Scores:
    """Return the scores of the predicted parts of `tests`, each by one fold, and of each axis."""
    axes = []
    for axis in range(tests.value.shape[1] if tests.value.ndim > 1 else 0):
        rows = tests._replace(value=tests.value[:, axis])
        own = [
            replace(part, y_train=part.y_train[:, axis], y_pred=part.y_pred[:, axis])
            for part in parts
        ]
        axes.append(_scores(rows, own, kind, period, split))
    y = tests.value
    by_fold = [metrics.score(y[part.row], part.y_pred, kind, period) for part in parts]
    chance = [metrics.chance(part.y_train, y[part.row], kind, period) for part in parts]
    names = metrics.METRICS[kind]
    per_fold = {name: tuple(fold[name] for fold in by_fold) for name in names}
    y_true = y[np.concatenate([part.row for part in parts])]
    y_pred = np.concatenate([part.y_pred for part in parts])
    classes = np.unique(np.concatenate([y, *(part.y_train for part in parts)]))
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
        axes=tuple(axes),
    )


def deviation(values: Sequence[float]) -> float:
    """Return the sample standard deviation (ddof = 1), NaN for a single value."""
    return float(np.std(values, ddof=1)) if len(values) > 1 else float("nan")


def _predictions(tests: TaskData, parts: Sequence[_Part], *, in_input_order: bool) -> Predictions:
    """Return the predictions of all folds, in the order of the folds or of the input."""
    row = np.concatenate([part.row for part in parts])
    fold = np.repeat([part.fold for part in parts], [len(part.row) for part in parts])
    y_pred = np.concatenate([part.y_pred for part in parts])
    probabilities = [part.probability for part in parts if part.probability is not None]
    order = np.argsort(row) if in_input_order else np.arange(len(row))
    return Predictions(
        row=row[order],
        fold=fold[order],
        y_true=tests.value[row[order]],
        y_pred=y_pred[order],
        probability=np.concatenate(probabilities)[order] if probabilities else None,
    )


def estimate_score(
    result: CrossValidation | Tested, grasps: np.ndarray | Sequence, *, seed: int = 0
) -> Estimate:
    """Return the mean over folds of accuracy or RMSE, with its 95 % interval over grasps.

    `grasps` (n,) has the grasp of each row of the input, or of each extra row for a `Tested`. With
    names of a larger unit, e.g. the placement, the interval is over this unit. The interval is that
    of `intervals.metric_interval`, which uses `seed`, and the chance level is `Scores.chance`.

    Raises ValueError if the number of grasps is not the number of rows.

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
    scores = result.scores
    predictions = result.predictions
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


def overall(
    known: Predictions, withheld: Predictions, period: float | None = None
) -> dict[str, tuple[float, ...]]:
    """Return metrics of recordings with training values and withheld values together, by fold.

    `known` are the predictions of recordings with training values. A fold tests a part of the known
    recordings, but all withheld recordings. The known recordings of a fold are therefore weighted,
    so that their weights add up to the number of all known recordings.
    """
    per_fold = []
    for fold in np.unique(known.fold):
        test = known.fold == fold
        new = withheld.fold == fold
        known_weight = np.full(test.sum(), len(known.fold) / test.sum())
        weight = np.concatenate([known_weight, np.ones(new.sum())])
        y_true = np.concatenate([known.y_true[test], withheld.y_true[new]])
        y_pred = np.concatenate([known.y_pred[test], withheld.y_pred[new]])
        per_fold.append(metrics.regression(y_true, y_pred, period, weight))
    return {name: tuple(fold[name] for fold in per_fold) for name in metrics.METRICS["regression"]}


def overall_chance(
    known: Predictions, withheld: Predictions, period: float | None = None
) -> dict[str, tuple[float, ...]]:
    """Return the metrics of `overall` for a guess: the mean target of the training part."""
    mean_target = {
        fold: metrics.middle(known.y_true[known.fold != fold], period)
        for fold in np.unique(known.fold)
    }

    def guess(predictions: Predictions) -> Predictions:
        y_pred = np.array([mean_target[fold] for fold in predictions.fold])
        return replace(predictions, y_pred=y_pred)

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
    """Return the 95 % interval over grasps of the mean over folds of the RMSE of `overall`.

    `known_grasps` and `withheld_grasps` have the grasp of each row of the input of `known` and of
    `withheld`; their element `row` is the grasp of a prediction.
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
