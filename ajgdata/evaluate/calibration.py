"""Temperature scaling, reliability of probabilities, and quantiles that hold for new grasps.

Temperature scaling: Guo et al. 2017, On calibration of modern neural networks, ICML. In quantiles
of residuals or distances, each grasp has the same weight, because grasps are exchangeable (Lee,
Barber, Willett 2023, arXiv 2306.06342). The new grasp also has this weight.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import logsumexp, softmax

#: Smallest and largest temperature of the search.
TEMPERATURES = (0.05, 20.0)
#: Smallest probability of which a logarithm is taken, so that the logarithm is finite.
TINIEST = 1e-12
#: Number of equal bins of the confidence, from 0 to 1.
CONFIDENCE_BINS = 10


def temperature(log_probability: np.ndarray, label: np.ndarray, smoothing: float = 0.0) -> float:
    """Return the T that makes the labels most probable under softmax(log p / T).

    `log_probability` (n, n_classes) are log p; `label` (n,) are column numbers. With a label
    smoothing ε (`smoothing`), the target probability of a class is (1 - ε) [class = label] + ε /
    n_classes.
    """
    rows = np.arange(len(label))

    def cross_entropy(log_t: float) -> float:
        z = log_probability / np.exp(log_t)
        target = (1 - smoothing) * z[rows, label] + smoothing * z.mean(axis=1)
        return float(np.mean(logsumexp(z, axis=1) - target))

    bounds = tuple(np.log(TEMPERATURES))
    return float(np.exp(minimize_scalar(cross_entropy, bounds=bounds, method="bounded").x))


def with_temperature(probability: np.ndarray, t: float) -> np.ndarray:
    """Return softmax(log p / t) (n, n_classes) of probabilities p (n, n_classes).

    The order of the classes is unchanged. Probabilities are more equal if t > 1.
    """
    return softmax(np.log(np.maximum(probability, TINIEST)) / t, axis=1)


@dataclass(frozen=True)
class ConfidenceBin:
    """Predictions whose confidence is in (low, high]."""

    low: float
    high: float
    count: int  #: predictions
    confidence: float  #: mean confidence
    accuracy: float  #: share of correct predictions


def reliability(confidence: np.ndarray, is_correct: np.ndarray) -> list[ConfidenceBin]:
    """Return the accuracy of predictions in equal bins of their confidence.

    `confidence` (n,) is between 0 and 1; `is_correct` (n,) is boolean. Empty bins are omitted.
    """
    edges = np.linspace(0, 1, CONFIDENCE_BINS + 1)
    number = np.clip(np.searchsorted(edges, confidence, side="left") - 1, 0, CONFIDENCE_BINS - 1)
    return [
        ConfidenceBin(
            low=float(edges[b]),
            high=float(edges[b + 1]),
            count=int((number == b).sum()),
            confidence=float(confidence[number == b].mean()),
            accuracy=float(is_correct[number == b].mean()),
        )
        for b in np.unique(number)
    ]


def accuracy_of_most_confident(
    confidence: np.ndarray, is_correct: np.ndarray, shares: Sequence[float]
) -> list[float]:
    """Return the accuracy of the most confident predictions, for each of the `shares`.

    `confidence` (n,) and the boolean `is_correct` (n,) are those of n predictions. A share is that
    of the predictions that are kept, above 0 and up to 1; a part of a prediction counts as this
    part. Of equally confident predictions, a random part is kept, so their mean accuracy counts.

    >>> import numpy as np
    >>> from ajgdata.evaluate.calibration import accuracy_of_most_confident
    >>> is_correct = np.array([False, True, True, False])
    >>> accuracy_of_most_confident(np.array([0.5, 0.9, 0.5, 0.5]), is_correct, [0.25, 1.0])
    [1.0, 0.5]
    """
    values, member = np.unique(-confidence, return_inverse=True)
    counts = np.bincount(member, minlength=len(values))
    correct = np.bincount(member, is_correct, minlength=len(values))
    kept = np.concatenate([[0.0], np.cumsum(counts)])
    kept_correct = np.concatenate([[0.0], np.cumsum(correct)])
    numbers = np.array(shares) * len(confidence)
    accuracy: list[float] = (np.interp(numbers, kept, kept_correct) / numbers).tolist()
    return accuracy


def calibration_error(bins: Sequence[ConfidenceBin]) -> float:
    """Return the expected calibration error: mean |confidence - accuracy| over predictions."""
    predictions = sum(part.count for part in bins)
    total = sum(part.count * abs(part.confidence - part.accuracy) for part in bins)
    return total / predictions


def weighted_quantile(values: np.ndarray, weights: np.ndarray, share: float) -> np.ndarray:
    """Return a weighted quantile of each column (n,) of `values` (m, n).

    This is the smallest value at which the `weights` (m,) of all values up to it add up to `share`;
    infinity if all weights together are less than `share`.
    """
    order = np.argsort(values, axis=0)
    reached = np.cumsum(weights[order], axis=0) >= share - 1e-12
    first = np.argmax(reached, axis=0)
    in_order = np.take_along_axis(values, order, 0)
    quantile = np.take_along_axis(in_order, first[None], 0)[0]
    return np.where(reached.any(axis=0), quantile, np.inf)


def grasp_weights(groups: np.ndarray) -> np.ndarray:
    """Return weights (m,) of recordings that give each group, and one new group, equal weight.

    The weights of the recordings of a group (`groups` (m,)) add up to 1 / (number of groups + 1).
    """
    _, inverse, counts = np.unique(groups, return_inverse=True, return_counts=True)
    return 1.0 / (counts[inverse] * (len(counts) + 1))
