"""Sorting by sound: hold, hear, decide; go on until no class is probable enough.

`decide` is the decision alone, on one vector of probabilities: a live run uses it as it stands.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

#: A run that never hesitates is ended here.
LONGEST_RUN = 1000


@dataclass(frozen=True)
class Run:
    """One run: objects sorted before it stopped, and how many of them into the wrong bin.

    `before_mistake`: how many were sorted before the first wrong one, or in all.
    """

    sorts: int
    mistakes: int
    before_mistake: int


def decide(probability: np.ndarray, threshold: float) -> int | None:
    """Number of the class to sort into, or None: stop, nothing is probable enough.

    `probability` (n_classes,); of equals the first. The threshold itself is enough.
    """
    best = int(np.argmax(probability))
    return best if probability[best] >= threshold else None


def sort_stream(probability: np.ndarray, label: np.ndarray, threshold: float, seed: int) -> Run:
    """Sort objects that come in random order until the decision is to stop.

    `probability` (n, n_classes) are those of `n` recorded grasps and `label` (n,) their true
    classes. Each object is equally likely to come next, and any of its grasps is then held.
    """
    generator = np.random.default_rng(seed)
    grasps = [np.flatnonzero(label == one) for one in np.unique(label)]
    mistakes, before_mistake = 0, -1
    for sorts in range(LONGEST_RUN):
        row = generator.choice(grasps[generator.integers(len(grasps))])
        taken = decide(probability[row], threshold)
        if taken is None:
            return Run(sorts, mistakes, sorts if before_mistake < 0 else before_mistake)
        if taken != label[row]:
            mistakes += 1
            before_mistake = sorts if before_mistake < 0 else before_mistake
    return Run(LONGEST_RUN, mistakes, LONGEST_RUN if before_mistake < 0 else before_mistake)


@dataclass(frozen=True)
class Accepted:
    """Of all recorded grasps: the share accepted, and the share of those that is right (NaN when
    none is accepted)."""

    share: float
    accuracy: float


def accepted(probability: np.ndarray, label: np.ndarray, threshold: float) -> Accepted:
    """What the threshold lets pass; arguments as for `sort_stream`."""
    taken = [decide(row, threshold) for row in probability]
    right = [one == true for one, true in zip(taken, label, strict=True) if one is not None]
    return Accepted(len(right) / len(taken), float(np.mean(right)) if right else float("nan"))
