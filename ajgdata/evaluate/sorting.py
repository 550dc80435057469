"""Sorting by sound: grasp, record, decide; a run ends when no class is probable enough.

A run has two results. *Sorted before the first error* is the main result. *Sorted by the paper's
rule* counts all objects until the model is uncertain, also those in a wrong bin: an overconfident
model is never uncertain. `decide` is also the decision of a live run.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

#: A run that never hesitates is ended here.
LONGEST_RUN = 1000
STOP = -1  #: among numbers of classes


@dataclass(frozen=True)
class Run:
    """One run.

    `before_error`: objects sorted before the first error, or before the model was uncertain if
    there was no error. `sorts`: objects sorted by the paper's rule, until the model was uncertain;
    `mistakes` of these are in a wrong bin.
    """

    sorts: int
    mistakes: int
    before_error: int


def decide(probability: np.ndarray, threshold: float) -> int | None:
    """Return the number of the class to sort into, or None: stop, nothing is probable enough.

    `probability` (n_classes,); of equals the first. The threshold itself is enough.
    """
    best = int(np.argmax(probability))
    return best if probability[best] >= threshold else None


def decisions(probability: np.ndarray, threshold: float) -> np.ndarray:
    """Return `decide` for each row of (n, n_classes): numbers of classes (n,), STOP where it is
    None."""
    taken = (decide(row, threshold) for row in probability)
    return np.array([STOP if number is None else number for number in taken])


def sort_stream(taken: np.ndarray, label: np.ndarray, seed: int) -> Run:
    """Sort objects in random order until the decision is to stop.

    `taken` (n,) are the `decisions` on `n` recorded grasps and `label` (n,) their true classes.
    Each object is equally likely to come next, and any of its grasps is then held.
    """
    generator = np.random.default_rng(seed)
    order, of_class = np.argsort(label, kind="stable"), np.unique(label, return_counts=True)[1]
    first = np.cumsum(of_class) - of_class
    coming = generator.integers(len(of_class), size=LONGEST_RUN)
    rows = order[first[coming] + generator.integers(of_class[coming])]
    stops = np.flatnonzero(taken[rows] == STOP)
    rows = rows[: stops[0]] if len(stops) else rows
    wrong = np.flatnonzero(taken[rows] != label[rows])
    return Run(len(rows), len(wrong), int(wrong[0]) if len(wrong) else len(rows))


@dataclass(frozen=True)
class Accepted:
    """Share of all recorded grasps that is accepted, and share of those that is right (NaN when
    none is accepted)."""

    share: float
    accuracy: float


def accepted(taken: np.ndarray, label: np.ndarray) -> Accepted:
    """Return what the threshold lets pass of the decisions `taken` (n,), with true classes
    `label` (n,) (see `sort_stream`)."""
    passed = taken != STOP
    right = float(np.mean(taken[passed] == label[passed])) if passed.any() else float("nan")
    return Accepted(float(passed.mean()), right)
