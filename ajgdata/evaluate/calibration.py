"""Do probabilities mean what they say? Reliability, and temperature scaling on an inner split.

Temperature scaling: Guo et al. 2017, On calibration of modern neural networks, ICML.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import log_softmax, logsumexp, softmax
from threadpoolctl import threadpool_limits

from ajgdata.evaluate.splits import grouped_folds
from ajgdata.models import fit_model, make_model
from ajgdata.types import NotPossibleError

#: Temperatures that are searched: 20 times sharper to 20 times flatter.
TEMPERATURES = (0.05, 20.0)
#: Below this a probability says no more; its logarithm stays finite.
TINIEST = 1e-12


@dataclass(frozen=True)
class Bin:
    """Predictions whose confidence lies in (low, high]."""

    low: float
    high: float
    count: int
    confidence: float  #: mean
    accuracy: float  #: share that was right


@dataclass(frozen=True, eq=False)
class Calibrated:
    """Out-of-fold probabilities (n, n_classes) in the order of the rows, plain and scaled."""

    classes: np.ndarray
    plain: np.ndarray
    scaled: np.ndarray
    temperatures: tuple[float, ...]  #: of the folds


def temperature(log_probability: np.ndarray, label: np.ndarray, doubt: float = 0.0) -> float:
    """Return the T that makes `label` (n,), column numbers, most probable under softmax(log p / T).

    `log_probability` (n, n_classes). A share `doubt` of each row is taken for any class at random.
    """
    rows = np.arange(len(label))

    def loss(log_t: float) -> float:
        z = log_probability / np.exp(log_t)
        meant = (1 - doubt) * z[rows, label] + doubt * z.mean(axis=1)
        return float(np.mean(logsumexp(z, axis=1) - meant))

    low, high = np.log(TEMPERATURES)
    return float(np.exp(minimize_scalar(loss, bounds=(low, high), method="bounded").x))


def with_temperature(probability: np.ndarray, t: float) -> np.ndarray:
    """Return softmax(log p / t) of probabilities (n, n_classes): the same order of classes, flatter
    for t > 1."""
    return softmax(np.log(np.maximum(probability, TINIEST)) / t, axis=1)


def calibrated(
    features: np.ndarray,
    target: np.ndarray,
    groups: np.ndarray | Sequence,
    *,
    model: str,
    folds: int = 5,
    seed: int = 0,
) -> Calibrated:
    """Return out-of-fold probabilities of a classifier, as they are and scaled by a temperature.

    `features` (n, n_features), `target` (n,) class labels, `groups` (n,). For each fold the
    temperature is found on groups held out of its training part, by a model trained on the rest of
    that part; the test part has no say. Raises ValueError for a model without probabilities and for
    folds that cannot be made.
    """
    y = np.asarray(target)
    group = np.asarray(groups)
    data = features, y, group
    classes, label = np.unique(y, return_inverse=True)
    plain, scaled = (np.empty((len(y), len(classes))) for _ in range(2))
    temperatures = []
    with threadpool_limits(limits=1):
        for train, test in grouped_folds(y, group, "classification", folds, seed):
            inner_folds = min(folds, len(np.unique(group[train])))
            inner = grouped_folds(y[train], group[train], "classification", inner_folds, seed)
            fit, held = (train[part] for part in inner[0])
            log_p = np.log(np.maximum(_probabilities(model, seed, data, fit, held), TINIEST))
            t = temperature(log_softmax(log_p, axis=1), label[held])
            plain[test] = _probabilities(model, seed, data, train, test)
            scaled[test] = with_temperature(plain[test], t)
            temperatures.append(t)
    return Calibrated(classes, plain, scaled, tuple(temperatures))


def _probabilities(
    model: str, seed: int, data: tuple[np.ndarray, ...], fit: np.ndarray, rows: np.ndarray
) -> np.ndarray:
    made = make_model(model, "classification", seed)
    if not hasattr(made, "predict_proba"):
        raise NotPossibleError(f"model {model!r} has no probabilities: choose another")
    features, y, group = data
    return fit_model(made, features[fit], y[fit], group[fit]).predict_proba(features[rows])


def reliability(confidence: np.ndarray, right: np.ndarray, bins: int = 10) -> list[Bin]:
    """Return the accuracy of predictions in equal bins of their confidence (n,), in 0..1.

    `right` (n,) says which were; bins that hold none are left out.
    """
    edges = np.linspace(0, 1, bins + 1)
    number = np.clip(np.searchsorted(edges, confidence, side="left") - 1, 0, bins - 1)
    return [
        Bin(
            float(edges[b]),
            float(edges[b + 1]),
            int((number == b).sum()),
            float(confidence[number == b].mean()),
            float(right[number == b].mean()),
        )
        for b in np.unique(number)
    ]


def calibration_error(bins: Sequence[Bin]) -> float:
    """Return the expected calibration error: mean |confidence - accuracy| over predictions."""
    total = sum(interval.count for interval in bins)
    return (
        sum(interval.count * abs(interval.confidence - interval.accuracy) for interval in bins)
        / total
    )
