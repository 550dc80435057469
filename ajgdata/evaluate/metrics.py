"""Errors of predictions, as plain floats. A metric that is undefined is NaN, never a guess."""

from __future__ import annotations

import numpy as np
from sklearn import metrics
from sklearn.dummy import DummyClassifier, DummyRegressor

from ajgdata.types import Kind

#: Metrics by kind; the first is the one that a report leads with.
METRICS: dict[str, tuple[str, ...]] = {
    "regression": ("rmse", "mae", "r2"),
    "classification": ("accuracy", "balanced_accuracy", "macro_f1"),
}


def score(y_true: np.ndarray, y_pred: np.ndarray, kind: Kind) -> dict[str, float]:
    """All metrics of `kind` for targets and predictions (n,)."""
    return (regression if kind == "regression" else classification)(y_true, y_pred)


def regression(y_true: np.ndarray, y_pred: np.ndarray) -> dict[str, float]:
    """`rmse` and `mae` in the unit of the target; `r2` = 1 - SS_res / SS_tot (1).

    `r2` is NaN where all targets are equal, as in a fold that holds one object size.
    """
    r2 = metrics.r2_score(y_true, y_pred) if np.ptp(y_true) > 0 else np.nan
    return {
        "rmse": float(metrics.root_mean_squared_error(y_true, y_pred)),
        "mae": float(metrics.mean_absolute_error(y_true, y_pred)),
        "r2": float(r2),
    }


def classification(y_true: np.ndarray, y_pred: np.ndarray) -> dict[str, float]:
    """`accuracy`; `balanced_accuracy`: mean recall of the classes in `y_true`; `macro_f1`: mean
    F1 of the classes in `y_true` or `y_pred`, 0 for a class that was never right. All in 0..1."""
    present = np.unique(y_true)
    recall = metrics.recall_score(y_true, y_pred, labels=present, average="macro", zero_division=0)
    return {
        "accuracy": float(metrics.accuracy_score(y_true, y_pred)),
        "balanced_accuracy": float(recall),
        "macro_f1": float(metrics.f1_score(y_true, y_pred, average="macro", zero_division=0)),
    }


def confusion(y_true: np.ndarray, y_pred: np.ndarray, classes: np.ndarray) -> np.ndarray:
    """Counts (n_classes, n_classes): rows true, columns predicted, as `classes`."""
    return metrics.confusion_matrix(y_true, y_pred, labels=classes)


def chance(y_train: np.ndarray, y_test: np.ndarray, kind: Kind) -> dict[str, float]:
    """What a model scores that ignores its input: the training mean, or the commonest class."""
    dummy = DummyRegressor() if kind == "regression" else DummyClassifier(strategy="prior")
    dummy.fit(np.zeros((len(y_train), 1)), y_train)
    return score(y_test, dummy.predict(np.zeros((len(y_test), 1))), kind)
