"""Sorting by sound: grasp, record, decide; a run ends with the first refusal.

A model *refuses* an object if no class is probable enough, and *accepts* it otherwise. Two shares
describe a model: accepted among presented, and correct among accepted. A run counts the objects
until the first refusal, and its errors separately, because an error does not end a run. `decide` is
also the decision of a live run.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ajgdata.evaluate.agreement import UNDEFINED, Interval
from ajgdata.evaluate.intervals import mean_interval

#: A run of a model that refuses nothing ends here.
LONGEST_RUN = 1000
STOP = -1  #: refusal, among numbers of classes


def decide(probability: np.ndarray, threshold: float) -> int | None:
    """Return the number of the class to sort into, or None: no class is probable enough.

    `probability` (n_classes,). Of equally probable classes, the first one counts. The threshold
    itself is enough.
    """
    best = int(np.argmax(probability))
    return best if probability[best] >= threshold else None


def decisions(probability: np.ndarray, threshold: float) -> np.ndarray:
    """Return the number of the class that each grasp is sorted into (n,), or STOP.

    `probability` (n, n_classes); see `decide`.
    """
    numbers = (decide(row, threshold) for row in probability)
    return np.array([STOP if number is None else number for number in numbers])


@dataclass(frozen=True)
class Share:
    """A share of recordings in 0..1, with its 95 % interval over grasps."""

    value: float
    interval: Interval


@dataclass(frozen=True)
class DecisionShares:
    """Shares of decisions on `grasps` grasps.

    `accuracy` is the share of recordings whose most probable class is correct. `accepted` is the
    share of recordings that are not refused, `correct` the share of correct ones among them (NaN
    if nothing is accepted).
    """

    grasps: int
    accuracy: float
    accepted: Share
    correct: Share


def decision_shares(
    probability: np.ndarray, decided: np.ndarray, label: np.ndarray, grasp: np.ndarray
) -> DecisionShares:
    """Return the shares of decisions.

    `probability` (n, n_classes), `decided` (n,) decisions, `label` (n,) true classes, `grasp` (n,)
    the grasp of each recording: recordings of one grasp are not independent.
    """
    is_accepted = decided != STOP
    is_correct = decided == label
    correct = Share(np.nan, UNDEFINED)
    if is_accepted.any():
        correct = _share(is_correct[is_accepted], grasp[is_accepted])
    return DecisionShares(
        grasps=len(np.unique(grasp)),
        accuracy=float(np.mean(probability.argmax(axis=1) == label)),
        accepted=_share(is_accepted, grasp),
        correct=correct,
    )


def _share(holds: np.ndarray, grasp: np.ndarray) -> Share:
    """Return the share of recordings for which `holds` (n,) is true."""
    interval = mean_interval(holds.astype(float), grasp, is_share=True)
    return Share(float(holds.mean()), interval)


@dataclass(frozen=True)
class SortingRun:
    """One run: objects sorted until the first refusal, and how many of them are in a wrong bin."""

    sorts: int
    errors: int


def run_of(decided: np.ndarray, label: np.ndarray, order: Iterable[int]) -> SortingRun:
    """Sort the rows of `order` until the first refusal.

    `decided` (n,) are decisions, `label` (n,) true classes. An error does not end a run.
    """
    rows = np.fromiter(order, int)
    refusals = np.flatnonzero(decided[rows] == STOP)
    if len(refusals):
        rows = rows[: refusals[0]]
    return SortingRun(len(rows), int(np.sum(decided[rows] != label[rows])))


def stream(label: np.ndarray, seed: int) -> np.ndarray:
    """Return rows (LONGEST_RUN,) of recordings with classes `label` (n,), in random order.

    Each class is equally likely to come next, and each of its recordings.
    """
    generator = np.random.default_rng(seed)
    order, of_class = np.argsort(label, kind="stable"), np.unique(label, return_counts=True)[1]
    first = np.cumsum(of_class) - of_class
    coming = generator.integers(len(of_class), size=LONGEST_RUN)
    return order[first[coming] + generator.integers(of_class[coming])]
