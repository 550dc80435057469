"""Sorting by sound: grasp, record, decide; a run ends when no class is probable enough.

A run has two results. *Sorted before the first error* is the main result. *Sorted by the paper's
rule* counts all objects until the model is uncertain, also those in a wrong bin: an overconfident
model is never uncertain. `decide` is also the decision of a live run.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

#: A run of a model that is never uncertain ends here.
LONGEST_RUN = 1000
STOP = -1  #: among numbers of classes


def decide(probability: np.ndarray, threshold: float) -> int | None:
    """Return the number of the class to sort into, or None: stop, nothing is probable enough.

    `probability` (n_classes,); of equals the first. The threshold itself is enough.
    """
    best = int(np.argmax(probability))
    return best if probability[best] >= threshold else None


def decisions(probability: np.ndarray, threshold: float) -> np.ndarray:
    """Return the number of the class that each grasp is sorted into (n,), or STOP.

    `probability` (n, n_classes); see `decide`.
    """
    numbers = (decide(row, threshold) for row in probability)
    return np.array([STOP if number is None else number for number in numbers])


def shares(probability: np.ndarray, taken: np.ndarray, label: np.ndarray) -> dict[str, float]:
    """Return the accuracy of all grasps, the sorted share, and its accuracy.

    `probability` (n, n_classes), `taken` (n,) decisions, `label` (n,) true classes. The accuracy of
    no grasps is NaN.
    """
    is_sorted = taken != STOP
    right = float(np.mean(taken[is_sorted] == label[is_sorted])) if is_sorted.any() else np.nan
    return {
        "accuracy": float(np.mean(probability.argmax(axis=1) == label)),
        "accepted": float(is_sorted.mean()),
        "right": right,
    }


@dataclass(frozen=True)
class Run:
    """One run.

    `before_error`: objects sorted before the first error, or before the model was uncertain if
    there was no error. `sorts`: objects sorted by the paper's rule, until the model was uncertain;
    `mistakes` of the sorted objects are in a wrong bin.
    """

    sorts: int
    mistakes: int
    before_error: int


def run_of(taken: np.ndarray, label: np.ndarray, order: Iterable[int]) -> Run:
    """Sort the rows of `order` until the decision is to stop.

    `taken` (n,) are decisions, `label` (n,) true classes. A wrong bin does not end a run.
    """
    rows = np.fromiter(order, int)
    stops = np.flatnonzero(taken[rows] == STOP)
    rows = rows[: stops[0]] if len(stops) else rows
    wrong = np.flatnonzero(taken[rows] != label[rows])
    return Run(len(rows), len(wrong), int(wrong[0]) if len(wrong) else len(rows))


def stream(label: np.ndarray, seed: int) -> np.ndarray:
    """Return rows (LONGEST_RUN,) of recordings with classes `label` (n,), in random order.

    Each class is equally likely to come next, and each of its recordings.
    """
    generator = np.random.default_rng(seed)
    order, of_class = np.argsort(label, kind="stable"), np.unique(label, return_counts=True)[1]
    first = np.cumsum(of_class) - of_class
    coming = generator.integers(len(of_class), size=LONGEST_RUN)
    return order[first[coming] + generator.integers(of_class[coming])]
