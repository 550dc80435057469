"""Cross-validation of one model on one task: errors, predictions, cost.

The three results are separate objects: `Scores` and `Predictions` are the same bytes for the same
inputs and seed; `Cost` is measured, hence never the same twice.
"""

from __future__ import annotations

import resource
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from sklearn.base import BaseEstimator, clone
from threadpoolctl import threadpool_limits

from ajgdata.evaluate import metrics
from ajgdata.evaluate.splits import Folds, grouped_folds, random_folds
from ajgdata.models import make_model
from ajgdata.types import Kind

REPEATS = 5  # timed predictions; their median ignores one interruption or two
TIMING_BUDGET_S = 1.0  # stop repeating a slow prediction after this long


@dataclass(frozen=True)
class Scores:
    """Errors. Every dict maps a metric's name (see `metrics.METRICS`) to floats.

    `mean` and `sd` are over folds, each fold counting once; `sd` is the sample standard deviation
    (ddof = 1). A metric undefined in a fold (NaN) is undefined in the mean: `pooled`, from all
    out-of-fold predictions together, is then the one to read. `chance` is the mean over the same
    folds of a model that ignores its input. `confusion` (rows true, columns predicted, in order
    of `classes`) is over all out-of-fold predictions; both are empty for regression.
    """

    kind: Kind
    split: str  #: "grouped" or "random"
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
    confusion: tuple[tuple[int, ...], ...]


@dataclass(frozen=True, eq=False)
class Predictions:
    """Out-of-fold prediction of each row, in the order of the input; arrays (n,)."""

    fold: np.ndarray
    y_true: np.ndarray
    y_pred: np.ndarray
    probability: np.ndarray | None  #: of the predicted class; None if the model has none


@dataclass(frozen=True)
class Cost:
    """What it took, one thread, on whatever machine this was.

    `train_s` is wall time and `train_cpu_s` processor time of fitting; the latter tells whether
    something else was using the machine. `inference_s_per_recording`: a whole test part
    predicted at once; `latency_s`: one recording predicted alone; both the median over repeats,
    then over folds. `peak_rss_mb` (1e6 bytes) is the largest resident memory that the process
    ever had, libraries and features included; `rss_increase_mb` by how much that exceeds what it
    held on entry, 0 if it had once been larger.
    """

    train_s: float
    train_cpu_s: float
    train_s_per_fold: tuple[float, ...]
    inference_s_per_recording: float
    latency_s: float
    peak_rss_mb: float
    rss_increase_mb: float


@dataclass(frozen=True)
class CrossValidation:
    """Result of `cross_validate`."""

    scores: Scores
    predictions: Predictions
    cost: Cost


@dataclass(frozen=True)
class _Fold:
    y_pred: np.ndarray
    probability: np.ndarray | None
    train_s: float
    train_cpu_s: float
    inference_s: float
    latency_s: float


def cross_validate(
    features: np.ndarray,
    target: np.ndarray,
    groups: np.ndarray | Sequence | None,
    *,
    kind: Kind,
    model: str | BaseEstimator,
    folds: int = 5,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> CrossValidation:
    """Train on all folds but one, predict that one; so for each fold.

    `features` (n, n_features); `target` (n,) numbers or class labels; `groups` (n,) labels that
    never straddle folds, or None for a random split, which flatters and is there to compare.
    `model` is a name in `models.MODELS` or an unfitted estimator. `progress(done, folds)` is called
    after each fold. BLAS and OpenMP get one thread: results do not depend on the number of cores,
    and jobs side by side do not fight.

    Raises ValueError for missing values (leave those recordings out first), for lengths that differ
    and for folds that cannot be made (see `splits`).
    """
    features, target = _validated(features, target, kind)
    if groups is None:
        parts = random_folds(target, kind, folds, seed)
    else:
        parts = grouped_folds(target, groups, kind, folds, seed)
    estimator = make_model(model, kind, seed) if isinstance(model, str) else model
    rss_mb = _memory_mb("VmRSS")
    done = []
    with threadpool_limits(limits=1):
        for train, test in parts:
            done.append(_run_fold(estimator, features, target, train, test))
            if progress is not None:
                progress(len(done), folds)
    predictions = _predictions(target, parts, done)
    n_groups = len(target) if groups is None else len(np.unique(np.asarray(groups)))
    return CrossValidation(
        Scores(
            kind=kind,
            split="random" if groups is None else "grouped",
            folds=folds,
            seed=seed,
            recordings=len(target),
            groups=n_groups,
            **_errors(predictions, parts, kind),
        ),
        predictions,
        _cost(done, rss_mb),
    )


def _validated(
    features: np.ndarray, target: np.ndarray, kind: Kind
) -> tuple[np.ndarray, np.ndarray]:
    features, target = np.asarray(features), np.asarray(target)
    if kind not in metrics.METRICS:
        raise ValueError(f"unknown kind {kind!r}: choose one of {', '.join(metrics.METRICS)}")
    if features.ndim != 2 or target.ndim != 1 or len(features) != len(target):
        raise ValueError(f"need features (n, f) and target (n,): {features.shape}, {target.shape}")
    if not np.isfinite(features).all():
        raise ValueError("features hold NaN or infinity: leave those recordings out")
    if kind == "regression":
        target = target.astype(np.float64)
    if target.dtype.kind == "f" and not np.isfinite(target).all():
        raise ValueError("target holds NaN or infinity: leave those recordings out")
    return features, target


def _run_fold(
    model: BaseEstimator, features: np.ndarray, target: np.ndarray, train: Any, test: Any
) -> _Fold:
    estimator: Any = clone(model)
    wall, cpu = time.perf_counter(), time.process_time()
    estimator.fit(features[train], target[train])
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    rows, single = features[test], features[test[:1]]
    y_pred, probability = estimator.predict(rows), None
    if hasattr(estimator, "predict_proba"):
        probability = estimator.predict_proba(rows).max(axis=1)
    return _Fold(
        y_pred,
        probability,
        wall,
        cpu,
        _median_s(lambda: estimator.predict(rows)) / len(rows),
        _median_s(lambda: estimator.predict(single)),
    )


def _median_s(call: Callable[[], object]) -> float:
    times: list[float] = []
    while len(times) < REPEATS and sum(times) < TIMING_BUDGET_S:
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def _predictions(target: np.ndarray, parts: Folds, done: list[_Fold]) -> Predictions:
    """Put the folds' predictions back into the order of the rows."""
    order = np.argsort(np.concatenate([test for _, test in parts]))
    number = np.repeat(np.arange(len(parts)), [len(test) for _, test in parts])
    probabilities = [fold.probability for fold in done if fold.probability is not None]
    return Predictions(
        fold=number[order],
        y_true=target,
        y_pred=np.concatenate([fold.y_pred for fold in done])[order],
        probability=np.concatenate(probabilities)[order] if probabilities else None,
    )


def _errors(predictions: Predictions, parts: Folds, kind: Kind) -> dict[str, Any]:
    """The fields of `Scores` that are computed."""
    y_true, y_pred = predictions.y_true, predictions.y_pred
    each = [metrics.score(y_true[test], y_pred[test], kind) for _, test in parts]
    chance = [metrics.chance(y_true[train], y_true[test], kind) for train, test in parts]
    names = metrics.METRICS[kind]
    per_fold = {name: tuple(fold[name] for fold in each) for name in names}
    classes = np.unique(y_true) if kind == "classification" else np.array([])
    confusion = metrics.confusion(y_true, y_pred, classes).tolist() if len(classes) else []
    return {
        "per_fold": per_fold,
        "mean": {name: float(np.mean(values)) for name, values in per_fold.items()},
        "sd": {name: float(np.std(values, ddof=1)) for name, values in per_fold.items()},
        "pooled": metrics.score(y_true, y_pred, kind),
        "chance": {name: float(np.mean([fold[name] for fold in chance])) for name in names},
        "classes": tuple(classes.tolist()),
        "confusion": tuple(tuple(row) for row in confusion),
    }


def _cost(done: list[_Fold], rss_mb: float) -> Cost:
    peak_mb = _memory_mb("VmHWM")
    return Cost(
        train_s=sum(fold.train_s for fold in done),
        train_cpu_s=sum(fold.train_cpu_s for fold in done),
        train_s_per_fold=tuple(fold.train_s for fold in done),
        inference_s_per_recording=statistics.median(fold.inference_s for fold in done),
        latency_s=statistics.median(fold.latency_s for fold in done),
        peak_rss_mb=peak_mb,
        rss_increase_mb=max(0.0, peak_mb - rss_mb),
    )


def _memory_mb(field: str) -> float:
    """Resident memory of this process now (VmRSS) or at most so far (VmHWM), in 1e6 bytes.

    Elsewhere than on Linux both are the most so far. There `ru_maxrss` is the only source; on
    Linux it would include what the process held before it became Python.
    """
    status = Path("/proc/self/status")
    if not status.exists():
        unit = 1 if sys.platform == "darwin" else 1024
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6
    lines = (line.split() for line in status.read_text().splitlines())
    return next(int(line[1]) for line in lines if line[0] == f"{field}:") * 1024 / 1e6
