"""Metrics of predictions as floats. An undefined metric is NaN."""

from __future__ import annotations

import numpy as np
from sklearn import metrics

from ajgdata.types import Kind

#: Metrics by kind. The report shows the first of each kind by default.
METRICS: dict[str, tuple[str, ...]] = {
    "regression": ("rmse", "mae", "r2"),
    "classification": ("accuracy", "balanced_accuracy", "macro_f1"),
}

LOWER_IS_BETTER = ("rmse", "mae")
#: Smallest and largest possible value of each metric.
RANGES: dict[str, tuple[float, float]] = {
    "rmse": (0.0, np.inf),
    "mae": (0.0, np.inf),
    "r2": (-np.inf, 1.0),
    "accuracy": (0.0, 1.0),
    "balanced_accuracy": (0.0, 1.0),
    "macro_f1": (0.0, 1.0),
}


def perfect_value(metric: str) -> float:
    """Return the best possible value of a metric: 0 for an error, 1 for a share."""
    lowest, highest = RANGES[metric]
    return lowest if metric in LOWER_IS_BETTER else highest


def score(
    y_true: np.ndarray, y_pred: np.ndarray, kind: Kind, period: float | None = None
) -> dict[str, float]:
    """Return all metrics of `kind` for targets and predictions (n,), or (n, k) of a vector.

    With a `period`, the targets y and y + period are equal (see `wrapped`).

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
    """Return differences (n,), shifted by multiples of a period into [-period / 2, period / 2).

    Without a period, they are unchanged.
    """
    if period is None:
        return difference
    return (difference + period / 2) % period - period / 2


def regression(
    y_true: np.ndarray,
    y_pred: np.ndarray,
    period: float | None = None,
    weight: np.ndarray | None = None,
) -> dict[str, float]:
    """Return `rmse` and `mae` in the unit of the target, and `r2` = 1 - SS_res / SS_tot.

    SS_res is the sum of the squared differences between `y_true` and `y_pred` (n,), and SS_tot the
    sum of the squared differences between `y_true` and its mean (see `middle`). For vectors (n, k),
    a difference is a Euclidean distance: `rmse` is the root of its mean square, and `mae` its mean.
    With a `period`, differences are wrapped (see `wrapped`). `weight` (n,) are the weights of the
    recordings; None: equal weights. `r2` is NaN if all targets are equal, for example in a fold
    that tests one object size.

    >>> regression(np.array([[0.0, 0], [1, 0]]), np.array([[3.0, 4], [1, 0]]))["mae"]
    2.5
    """
    difference = length(wrapped(y_pred - y_true, period))
    residual = float(np.average(np.square(difference), weights=weight))
    deviation = length(wrapped(y_true - middle(y_true, period, weight), period))
    total = float(np.average(np.square(deviation), weights=weight))
    is_constant = bool((y_true == y_true[:1]).all()) or total == 0
    return {
        "rmse": float(np.sqrt(residual)),
        "mae": float(np.average(difference, weights=weight)),
        "r2": float("nan") if is_constant else 1 - residual / total,
    }


def length(difference: np.ndarray) -> np.ndarray:
    """Return the absolute values of differences (n,), or the Euclidean lengths of vectors (n, k).

    >>> length(np.array([-2.0, 1.0])), length(np.array([[3.0, 4.0]]))
    (array([2., 1.]), array([5.]))
    """
    if difference.ndim == 1:
        return np.abs(difference)
    return np.asarray(np.sqrt(np.square(difference).sum(axis=1)))


def middle(
    y: np.ndarray, period: float | None, weight: np.ndarray | None = None
) -> float | np.ndarray:
    """Return the mean of y (n,); with a period P the circular mean; of vectors (n, k) their mean.

    The circular mean has the angle of the mean of exp(2 pi i y / P), in [0, P). `weight` (n,) are
    the weights of the values.
    """
    if y.ndim > 1:
        return np.asarray(np.average(y, axis=0, weights=weight))
    if period is None:
        return float(np.average(y, weights=weight))
    mean = np.average(np.exp(2j * np.pi * y / period), weights=weight)
    return float(np.angle(mean) * period / (2 * np.pi) % period)


def classification(y_true: np.ndarray, y_pred: np.ndarray) -> dict[str, float]:
    """Return three metrics of class labels (n,), all between 0 and 1.

    `accuracy` is the share of correct predictions. `balanced_accuracy` is the mean recall of the
    classes in `y_true`. `macro_f1` is the mean F1 of the classes in `y_true` or `y_pred`; it is 0
    for a class without a correct prediction.
    """
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
    """Return the metrics on `y_test` (m,) of a guess that ignores the input.

    The guess is the mean of `y_train` (n,), or its most frequent class. If several classes are the
    most frequent ones, the metrics are the means over them, so the order of names has no effect.
    The accuracy is at least that of a random guess, 1 / (number of classes): the most frequent
    class of a training part is less frequent in the test part.
    """
    if kind == "regression":
        guess = np.broadcast_to(middle(y_train, period), y_test.shape)
        return regression(y_test, guess, period)
    classes, counts = np.unique(y_train, return_counts=True)
    tied = classes[counts == counts.max()]
    tested = [int(np.count_nonzero(y_test == label)) for label in tied]
    # The metrics of a constant guess depend only on how often the class is tested.
    guesses = {
        count: classification(y_test, np.full(len(y_test), label))
        for count, label in zip(tested, tied, strict=True)
    }
    scores = guesses[tested[0]]
    if len(guesses) > 1:
        scores = {
            name: float(np.mean([guesses[count][name] for count in tested])) for name in scores
        }
    return {**scores, "accuracy": max(scores["accuracy"], 1 / len(classes))}
