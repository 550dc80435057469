"""Reliability of probabilities, temperature scaling, and quantiles that hold for new grasps.

Temperature scaling: Guo et al. 2017, On calibration of modern neural networks, ICML. Quantiles of
residuals or distances: each grasp has the same weight, because grasps are exchangeable (Lee,
Barber, Willett 2023, arXiv 2306.06342), and one weight is for the new grasp.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import logsumexp, softmax

#: Temperatures that are searched: 20 times sharper to 20 times flatter.
TEMPERATURES = (0.05, 20.0)
#: Below this a probability says no more; its logarithm stays finite.
TINIEST = 1e-12
CONFIDENCE_BINS = 10  #: of the confidence, 0 to 1


@dataclass(frozen=True)
class ConfidenceBin:
    """Predictions whose confidence lies in (low, high]."""

    low: float
    high: float
    count: int
    confidence: float  #: mean
    accuracy: float  #: share that was right


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


def reliability(confidence: np.ndarray, right: np.ndarray) -> list[ConfidenceBin]:
    """Return the accuracy of predictions in equal bins of their confidence (n,), in 0..1.

    `right` (n,) says which were; bins that hold none are left out.
    """
    edges = np.linspace(0, 1, CONFIDENCE_BINS + 1)
    number = np.clip(np.searchsorted(edges, confidence, side="left") - 1, 0, CONFIDENCE_BINS - 1)
    return [
        ConfidenceBin(
            float(edges[b]),
            float(edges[b + 1]),
            int((number == b).sum()),
            float(confidence[number == b].mean()),
            float(right[number == b].mean()),
        )
        for b in np.unique(number)
    ]


def calibration_error(bins: Sequence[ConfidenceBin]) -> float:
    """Return the expected calibration error: mean |confidence - accuracy| over predictions."""
    total = sum(interval.count for interval in bins)
    return (
        sum(interval.count * abs(interval.confidence - interval.accuracy) for interval in bins)
        / total
    )


def weighted_quantile(values: np.ndarray, weights: np.ndarray, share: float) -> np.ndarray:
    """Return the least of `values` (m, n) per column whose `weights` (m,) add up to `share`.

    Infinity where all of them together do not.
    """
    order = np.argsort(values, axis=0)
    reached = np.cumsum(weights[order], axis=0) >= share - 1e-12
    first = np.argmax(reached, axis=0)
    quantile = np.take_along_axis(np.take_along_axis(values, order, 0), first[None], 0)[0]
    return np.where(reached.any(axis=0), quantile, np.inf)


def grasp_weights(groups: np.ndarray) -> np.ndarray:
    """Return weights (m,), equal for all groups, that leave 1 / (groups + 1) for a new one."""
    _, inverse, counts = np.unique(groups, return_inverse=True, return_counts=True)
    return 1.0 / (counts[inverse] * (len(counts) + 1))
