"""Errors of predictions, as plain floats. A metric that is undefined is NaN, never a guess."""

from __future__ import annotations

import numpy as np
from sklearn import metrics
from sklearn.dummy import DummyClassifier

from ajgdata.types import Kind

#: Metrics by kind; the first is the one that a report leads with.
METRICS: dict[str, tuple[str, ...]] = {
    "regression": ("rmse", "mae", "r2"),
    "classification": ("accuracy", "balanced_accuracy", "macro_f1"),
}

LOWER_IS_BETTER = ("rmse", "mae")
#: Least and largest value that a metric can have.
RANGES: dict[str, tuple[float, float]] = {
    "rmse": (0.0, np.inf),
    "mae": (0.0, np.inf),
    "r2": (-np.inf, 1.0),
    "accuracy": (0.0, 1.0),
    "balanced_accuracy": (0.0, 1.0),
    "macro_f1": (0.0, 1.0),
}


def perfect_value(metric: str) -> float:
    """Return the best possible value of a metric: 0 of an error, 1 of a share."""
    lowest, highest = RANGES[metric]
    return lowest if metric in LOWER_IS_BETTER else highest


def score(
    y_true: np.ndarray, y_pred: np.ndarray, kind: Kind, period: float | None = None
) -> dict[str, float]:
    """Return all metrics of `kind` for targets and predictions (n,).

    >>> import numpy as np
    >>> from ajgdata.evaluate.metrics import score
    >>> score(np.array([10.0, 20]), np.array([13.0, 16]), "regression")  # mm in, mm out
    {'rmse': 3.5355339059327378, 'mae': 3.5, 'r2': 0.5}
    >>> score(np.array([0.0]), np.array([170.0]), "regression", period=180)["mae"]  # 10° round
    10.0
    """
    if kind == "regression":
        return regression(y_true, y_pred, period)
    return classification(y_true, y_pred)


def wrapped(difference: np.ndarray, period: float | None) -> np.ndarray:
    """Return differences (n,), or with a period the shortest way round, in
    [-period / 2, period / 2)."""
    if period is None:
        return difference
    return (difference + period / 2) % period - period / 2


def regression(
    y_true: np.ndarray,
    y_pred: np.ndarray,
    period: float | None = None,
    weight: np.ndarray | None = None,
) -> dict[str, float]:
    """Return `rmse` and `mae` in the unit of the target; `r2` = 1 - SS_res / SS_tot (1).

    With a `period` differences are the shortest way round, for SS_tot those to the best constant
    known (see `middle`). `r2` is NaN where all targets are equal, as in a fold that holds one
    object size.
    """
    squared = np.square(wrapped(y_pred - y_true, period))
    spread = np.square(wrapped(y_true - middle(y_true, period, weight), period))
    constant = np.ptp(y_true) == 0
    total = float(np.average(spread, weights=weight))
    mean = float(np.average(squared, weights=weight))
    distance = np.abs(wrapped(y_pred - y_true, period))
    return {
        "rmse": float(np.sqrt(mean)),
        "mae": float(np.average(distance, weights=weight)),
        "r2": float("nan") if constant or total == 0 else 1 - mean / total,
    }


def middle(y: np.ndarray, period: float | None, weight: np.ndarray | None = None) -> float:
    """Return the mean of y (n,), or with a period the circular mean: the angle of the mean of
    exp(2 pi i y / P), `weight` (n,) being how often each counts."""
    if period is None:
        return float(np.average(y, weights=weight))
    mean = np.average(np.exp(2j * np.pi * y / period), weights=weight)
    return float(np.angle(mean) * period / (2 * np.pi) % period)


def classification(y_true: np.ndarray, y_pred: np.ndarray) -> dict[str, float]:
    """Return metrics of class labels (n,): `accuracy`; `balanced_accuracy`: mean recall of the
    classes in `y_true`; `macro_f1`: mean F1 of the classes in `y_true` or `y_pred`, 0 for a class
    that was never right. All in 0..1."""
    present = np.unique(y_true)
    recall = metrics.recall_score(y_true, y_pred, labels=present, average="macro", zero_division=0)
    return {
        "accuracy": float(metrics.accuracy_score(y_true, y_pred)),
        "balanced_accuracy": float(recall),
        "macro_f1": float(metrics.f1_score(y_true, y_pred, average="macro", zero_division=0)),
    }


def chance(
    y_train: np.ndarray, y_test: np.ndarray, kind: Kind, period: float | None = None
) -> dict[str, float]:
    """Return the metrics on `y_test` (m,) of a guess that ignores the input: the mean of `y_train`
    (n,), or its commonest class. The accuracy is at least that of a uniform guess, because the
    commonest class of a training part is rarer in its test part."""
    if kind == "regression":
        return regression(y_test, np.full(len(y_test), middle(y_train, period)), period)
    dummy = DummyClassifier(strategy="prior").fit(np.zeros((len(y_train), 1)), y_train)
    scores = classification(y_test, dummy.predict(np.zeros((len(y_test), 1))))
    return scores | {"accuracy": max(scores["accuracy"], 1 / len(dummy.classes_))}
