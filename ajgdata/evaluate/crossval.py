"""Cross-validation of one model on one task: errors, predictions, cost.

The three results are separate objects: `Scores` and `Predictions` are the same bytes for the same
inputs and seed; `Cost` is measured, hence never the same twice.
"""

from __future__ import annotations

import resource
import statistics
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from sklearn.base import BaseEstimator, clone
from sklearn.utils.validation import check_consistent_length, check_X_y
from threadpoolctl import threadpool_limits

from ajgdata.evaluate import metrics
from ajgdata.evaluate.splits import grouped_folds, random_folds
from ajgdata.models import fit_model, make_model
from ajgdata.models.limits import CHOOSING, most_recordings
from ajgdata.types import Kind, NotPossibleError

TIMED = 5  # timed predictions; their median ignores one interruption or two
TIMING_BUDGET_S = 1.0  # stop repeating a slow prediction after this long


@dataclass(frozen=True, eq=False)
class ExtraTestSet:
    """Rows that are predicted and never trained on: features (n, f), target (n,), groups (n,).

    A fold's model predicts those whose group has no row among its training rows. So a second
    recording of a grasp is predicted only where that grasp is held out.
    """

    features: np.ndarray
    target: np.ndarray
    groups: np.ndarray


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

    kind: Kind
    split: str  #: "grouped" or "random", or the name of the extra rows
    folds: int
    seed: int
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


@dataclass(frozen=True)
class Tested:
    """Errors and predictions of a set of rows."""

    scores: Scores
    predictions: Predictions


@dataclass(frozen=True)
class Cost:
    """Times and memory of a cross-validation, one thread, on whatever machine this was.

    `train_s` is wall time and `train_cpu_s` processor time of fitting; the latter tells whether
    something else was using the machine. `inference_s_per_recording`: a whole test part
    predicted at once; `latency_s`: one recording predicted alone; both the median over repeats,
    then over folds. `peak_rss_mb` (1e6 bytes) is the largest resident memory that the process
    ever had, libraries and features included.
    """

    train_s: float
    train_cpu_s: float
    inference_s_per_recording: float
    latency_s: float
    peak_rss_mb: float


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


def cross_validate(
    features: np.ndarray,
    target: np.ndarray,
    groups: np.ndarray | Sequence | None,
    *,
    kind: Kind,
    model: str | BaseEstimator,
    folds: int = 5,
    seed: int = 0,
    period: float | None = None,
    extra_tests: Mapping[str, ExtraTestSet] | None = None,
    limits: Mapping[str, int] | None = None,
) -> CrossValidation:
    """Train on all folds but one, predict that one and the `extra_tests`; so for each fold.

    `features` (n, n_features); `target` (n,) numbers or class labels; `groups` (n,) labels that
    never straddle folds, or None for a random split, which flatters and is there to compare.
    `model` is a name in `models.MODELS` or an unfitted estimator; a tuned one is chosen in each
    fold by inner folds of its training part, which divide no group either. A target with a `period`
    is one where y and y + period are the same, as the angle of a bar is after half a turn.
    `limits` are the recordings that models are trained on at most, if not their own (see
    `models.limits`). BLAS and OpenMP get one thread: results do not depend on the number of cores,
    and jobs side by side do not fight.

    Raises ValueError for missing values (leave those recordings out first), for lengths that
    differ, for folds that cannot be made (see `splits`), and for extra rows without `groups`.

    >>> import ajgdata
    >>> from ajgdata.evaluate.crossval import cross_validate
    >>> size = ajgdata.load_dataset("size").all("size")
    >>> found = cross_validate(size.X, size.y, size.groups, kind="regression", model="knn", folds=4)
    >>> found.scores.folds, sorted(found.scores.mean), found.predictions.y_pred.shape
    (4, ['mae', 'r2', 'rmse'], (16,))
    """
    features, target = _validated(features, target, kind)
    extra = _checked_extra(extra_tests or {}, kind, features.shape[1], groups is not None)
    group = np.arange(len(target)) if groups is None else np.asarray(groups)
    split = "random" if groups is None else "grouped"
    parts = (
        random_folds(target, kind, folds, seed)
        if groups is None
        else grouped_folds(target, group, kind, folds, seed)
    )
    estimator, most = _unfitted(model, kind, seed, period, limits or {})
    own_parts: list[_Part] = []
    extra_parts: dict[str, list[_Part]] = {name: [] for name in extra}
    costs, used = [], []
    with threadpool_limits(limits=1):
        for fold, (train, test) in enumerate(parts):
            fitted, cost = _fitted(estimator, features, target, group, train, test, most)
            costs.append(cost)
            used.append((min(len(train), most or len(train)), len(train)))
            own_parts.append(_predict(fitted, features, test, fold, target[train]))
            for name, tests in extra.items():
                new = np.flatnonzero(~np.isin(tests.groups, group[train]))
                if len(new):
                    part = _predict(fitted, tests.features, new, fold, target[train])
                    extra_parts[name].append(part)
    own = ExtraTestSet(features, target, group)
    scores = _scores(own, own_parts, kind, period, seed, split)
    tested = {}
    for name, tests in extra.items():
        errors = _scores(tests, extra_parts[name], kind, period, seed, name)
        tested[name] = Tested(errors, _predictions(tests, extra_parts[name], in_order=False))
    predictions = _predictions(own, own_parts, in_order=True)
    thinned = tuple(used) if any(some < every for some, every in used) else ()
    return CrossValidation(scores, predictions, _total_cost(costs), tested, thinned)


def _unfitted(
    model: str | BaseEstimator,
    kind: Kind,
    seed: int,
    period: float | None,
    limits: Mapping[str, int],
) -> tuple[BaseEstimator, int | None]:
    """Return the unfitted estimator, and on how many recordings it is trained at most."""
    if not isinstance(model, str):
        return model, None
    made = make_model(model, kind, seed, period, limits.get(CHOOSING))
    return made, most_recordings(model, limits)


def _validated(
    features: np.ndarray, target: np.ndarray, kind: Kind
) -> tuple[np.ndarray, np.ndarray]:
    features, target = check_X_y(features, target, dtype=None)
    return features, target.astype(np.float64) if kind == "regression" else target


def _checked_extra(
    given: Mapping[str, ExtraTestSet], kind: Kind, width: int, is_grouped: bool
) -> dict[str, ExtraTestSet]:
    """Return the sets as arrays. Raises ValueError for one that cannot be tested on."""
    checked = {}
    for name, tests in given.items():
        if not len(tests.target):
            raise NotPossibleError(f"{name}: no recording is left to test on")
        features, target = _validated(tests.features, tests.target, kind)
        check_consistent_length(target, tests.groups)
        if features.shape[1] != width:
            widths = f"{features.shape[1]} features, not {width}"
            raise ValueError(f"{name} has {widths}: give both data sets the same feature settings")
        checked[name] = ExtraTestSet(features, target, np.asarray(tests.groups))
    if checked and not is_grouped:
        raise ValueError("extra rows need groups, or a grasp could be trained and tested on")
    return checked


def _fitted(
    model: BaseEstimator,
    features: np.ndarray,
    target: np.ndarray,
    group: np.ndarray,
    train: Any,
    test: Any,
    most: int | None,
) -> tuple[Any, tuple[float, ...]]:
    """Return a model trained on the rows `train`, and the first four numbers of its `Cost`, with
    predictions timed on `test`."""
    unfitted = clone(model)
    wall, cpu = time.perf_counter(), time.process_time()
    estimator = fit_model(unfitted, features[train], target[train], group[train], most)
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    rows, single = features[test], features[test[:1]]
    estimator.predict(rows)  # once untimed: the first call may load something
    return estimator, (
        wall, cpu, _predicting_s(estimator, rows) / len(rows), _predicting_s(estimator, single)
    )  # fmt: skip


def _predicting_s(estimator: Any, rows: np.ndarray) -> float:
    """Return the median wall time of some predictions of the rows, in s."""
    times: list[float] = []
    while len(times) < TIMED and sum(times) < TIMING_BUDGET_S:
        start = time.perf_counter()
        estimator.predict(rows)
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def _total_cost(folds: Sequence[tuple[float, ...]]) -> Cost:
    wall, cpu, together, alone = zip(*folds, strict=True)
    unit = 1 if sys.platform == "darwin" else 1024
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6
    return Cost(sum(wall), sum(cpu), statistics.median(together), statistics.median(alone), peak_mb)


def _predict(
    fitted: Any, features: np.ndarray, rows: np.ndarray, fold: int, y_train: np.ndarray
) -> _Part:
    y_pred, probability = fitted.predict(features[rows]), None
    if hasattr(fitted, "predict_proba"):
        probability = fitted.predict_proba(features[rows]).max(axis=1)
    return _Part(fold, rows, y_train, y_pred, probability)


def _predictions(tests: ExtraTestSet, parts: Sequence[_Part], *, in_order: bool) -> Predictions:
    """Return the folds' predictions together; `in_order`: put back into the order of the rows."""
    row = np.concatenate([part.row for part in parts])
    fold = np.repeat([part.fold for part in parts], [len(part.row) for part in parts])
    y_pred = np.concatenate([part.y_pred for part in parts])
    probabilities = [part.probability for part in parts if part.probability is not None]
    order = np.argsort(row) if in_order else np.arange(len(row))
    return Predictions(
        row=row[order],
        fold=fold[order],
        y_true=tests.target[row[order]],
        y_pred=y_pred[order],
        probability=np.concatenate(probabilities)[order] if probabilities else None,
    )


def _scores(
    tests: ExtraTestSet,
    parts: Sequence[_Part],
    kind: Kind,
    period: float | None,
    seed: int,
    split: str,
) -> Scores:
    if not parts:
        raise NotPossibleError(f"{split}: every one of its groups is trained on in every fold")
    y = tests.target
    each = [metrics.score(y[p.row], p.y_pred, kind, period) for p in parts]
    chance = [metrics.chance(p.y_train, y[p.row], kind, period) for p in parts]
    names = metrics.METRICS[kind]
    per_fold = {name: tuple(fold[name] for fold in each) for name in names}
    rows = np.concatenate([p.row for p in parts])
    y_true, y_pred = y[rows], np.concatenate([p.y_pred for p in parts])
    classes = np.array([])
    if kind == "classification":
        classes = np.unique(np.concatenate([y, *(p.y_train for p in parts)]))
    return Scores(
        kind=kind,
        split=split,
        folds=len(parts),
        seed=seed,
        recordings=len(y),
        groups=len(np.unique(tests.groups)),
        per_fold=per_fold,
        mean={name: float(np.mean(values)) for name, values in per_fold.items()},
        sd={name: deviation(values) for name, values in per_fold.items()},
        pooled=metrics.score(y_true, y_pred, kind, period),
        chance={name: float(np.mean([fold[name] for fold in chance])) for name in names},
        classes=tuple(classes.tolist()),
    )


def deviation(values: Sequence[float]) -> float:
    """Return the sample standard deviation (ddof = 1), NaN for a single value."""
    return float(np.std(values, ddof=1)) if len(values) > 1 else float("nan")
