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

#: A run of a model that is never uncertain ends here.
LONGEST_RUN = 1000
STOP = -1  #: among numbers of classes
#: A class that one look excludes may still be saved by others; its logarithm stays finite.
_TINIEST = 1e-12


def decide(probability: np.ndarray, threshold: float) -> int | None:
    """Return the number of the class to sort into, or None: stop, nothing is probable enough.

    `probability` (n_classes,); of equals the first. The threshold itself is enough.
    """
    best = int(np.argmax(probability))
    return best if probability[best] >= threshold else None


def combined(probability: np.ndarray) -> np.ndarray:
    """Return the joint probability (n_classes,) of looks at one object (looks, n_classes).

    Their product, made to sum to 1: Bayes' rule for looks that are independent given the class, and
    classes that are as frequent (the product rule of Kittler et al. 1998, On combining classifiers,
    IEEE Trans. Pattern Anal. Mach. Intell. 20(3)). Looks at one pose are not quite independent.
    """
    if len(probability) == 1:
        return np.asarray(probability[0])
    return np.asarray(softmax(np.log(np.maximum(probability, _TINIEST)).sum(axis=0)))


class Decided(NamedTuple):
    """Decisions on n placements: numbers of classes (n,), STOP if none was probable enough; how
    many looks each took (n,), and the probabilities (n, n_classes) decided by."""

    taken: np.ndarray
    looks: np.ndarray
    probability: np.ndarray

    def shares(self, label: np.ndarray) -> dict[str, float]:
        """Return accuracy, share of accepted placements, accuracy of those (NaN if there are none),
        share in a wrong bin, and the mean number of looks; `label` (n,) are true classes."""
        passed = self.taken != STOP
        right = float(np.mean(self.taken[passed] == label[passed])) if passed.any() else np.nan
        return {
            "accuracy": float(np.mean(self.probability.argmax(axis=1) == label)),
            "accepted": float(passed.mean()),
            "right": right,
            "wrong": float(np.mean(passed & (self.taken != label))),
            "mean_looks": float(self.looks.mean()),
        }


def look(probability: np.ndarray, threshold: float, most: int = 1) -> Decided:
    """Decide on placements (n, at least `most` looks, n_classes).

    There is another look, `most` in all, while no class reaches `threshold`.
    """
    taken, looks, together = [], [], []
    for placement in probability:
        for used in range(1, most + 1):
            joint = combined(placement[:used])
            number = decide(joint, threshold)
            if number is not None:
                break
        taken.append(STOP if number is None else number)
        looks.append(used)
        together.append(joint)
    return Decided(np.array(taken), np.array(looks), np.array(together))


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


def orders(count: int, runs: int, seed: int) -> list[np.ndarray]:
    """Return for each run the order (count,) in which placements come, each of them once."""
    return [np.random.default_rng([seed, run]).permutation(count) for run in range(runs)]
