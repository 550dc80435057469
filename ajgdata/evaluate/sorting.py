"""Sorting by sound: grasp, record, decide; a run ends when no class is probable enough.

A run has two results. *Sorted before the first error* is the main result. *Sorted by the paper's
rule* counts all objects until the model is uncertain, also those in a wrong bin: an overconfident
model is never uncertain. `decide` is also the decision of a live run.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import softmax

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


#: A class that one look excludes may still be saved by others; its logarithm stays finite.
_TINIEST = 1e-12


def combined(probability: np.ndarray) -> np.ndarray:
    """Return what looks at one object say together, (n_classes,), of (looks, n_classes).

    Their product, made to sum to 1: Bayes' rule for looks that are independent given the class, and
    classes that are as frequent (the product rule of Kittler et al. 1998, On combining classifiers,
    IEEE Trans. Pattern Anal. Mach. Intell. 20(3)). Looks at one pose are not quite independent.
    """
    if len(probability) == 1:
        return np.asarray(probability[0])
    return np.asarray(softmax(np.log(np.maximum(probability, _TINIEST)).sum(axis=0)))


class Looked(NamedTuple):
    """Decisions on n placements: numbers of classes (n,), STOP where none was probable enough; how
    many looks each took (n,), and the probabilities (n, n_classes) decided by."""

    taken: np.ndarray
    looks: np.ndarray
    probability: np.ndarray


def look(probability: np.ndarray, threshold: float, most: int, *, always: bool = False) -> Looked:
    """Decide on placements (n, at least `most` looks, n_classes), by no more than `most` looks.

    Another look is had while no class reaches `threshold`; `always`: each placement has all.
    """
    taken, looks, together = [], [], []
    for placement in probability:
        for used in range(most if always else 1, most + 1):
            joint = combined(placement[:used])
            number = decide(joint, threshold)
            if number is not None:
                break
        taken.append(STOP if number is None else number)
        looks.append(used)
        together.append(joint)
    return Looked(np.array(taken), np.array(looks), np.array(together))


def orders(count: int, runs: int, seed: int) -> list[np.ndarray]:
    """Return for each run the order (count,) in which placements come, each of them once."""
    return [np.random.default_rng([seed, run]).permutation(count) for run in range(runs)]


@dataclass(frozen=True)
class LiveRun(Run):
    """A run over placements, each of which comes once.

    `looks` were had in all, also at the object that stopped it: that is `stopped_at`, the row of
    the placement, None if every one was sorted.
    """

    looks: int
    stopped_at: int | None


def run_in_order(looked: Looked, label: np.ndarray, order: Iterable[int]) -> LiveRun:
    """Sort placements in `order` until the decision on one is to stop; `label` (n,) is the truth.

    A wrong bin ends nothing: nobody tells the robot.
    """
    rows = np.fromiter(order, int)
    stops = np.flatnonzero(looked.taken[rows] == STOP)
    sorts = int(stops[0]) if len(stops) else len(rows)
    done = rows[:sorts]
    wrong = np.flatnonzero(looked.taken[done] != label[done])
    return LiveRun(
        sorts=sorts,
        mistakes=len(wrong),
        before_error=int(wrong[0]) if len(wrong) else sorts,
        looks=int(looked.looks[rows[: sorts + 1]].sum()),
        stopped_at=int(rows[sorts]) if len(stops) else None,
    )
