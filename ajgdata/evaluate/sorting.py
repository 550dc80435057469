"""Sorting by sound: decisions, and runs that end with the first refusal.

A model *refuses* an object if no class is probable enough, otherwise it *accepts* the object. Two
shares describe a model: accepted objects among all objects, and correct decisions among the
accepted objects. A run counts the objects until the first refusal. An error does not end a run, so
errors are counted separately. Live runs also use `decide`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ajgdata.evaluate.agreement import UNDEFINED, Interval
from ajgdata.evaluate.intervals import mean_interval

#: Largest number of objects of a run.
LONGEST_RUN = 1000
#: Decision that refuses an object. Other decisions are numbers of classes.
STOP = -1


def decide(probability: np.ndarray, threshold: float) -> int | None:
    """Return the number of the most probable class; None if its probability is below `threshold`.

    `probability` (n_classes,). Of equally probable classes, this is the first.
    """
    best = int(np.argmax(probability))
    return best if probability[best] >= threshold else None


def decisions(probability: np.ndarray, threshold: float) -> np.ndarray:
    """Return the decisions (n,) on recordings: numbers of classes, or STOP.

    `probability` (n, n_classes); see `decide`.
    """
    numbers = (decide(row, threshold) for row in probability)
    return np.array([STOP if number is None else number for number in numbers])


@dataclass(frozen=True)
class Share:
    """Share of recordings, between 0 and 1, with its 95 % interval over grasps."""

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
    """Return the shares of the decisions `decided` (n,) on recordings.

    `probability` (n, n_classes); `label` (n,) are numbers of the true classes. `grasp` (n,) is the
    grasp of each recording, because recordings of one grasp are not independent.
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
    """Return the share of recordings (n,) for which `holds` (n,) is true."""
    interval = mean_interval(holds.astype(float), grasp, is_share=True)
    return Share(float(holds.mean()), interval)


@dataclass(frozen=True)
class SortingRun:
    """Number of objects that a run sorts before the first refusal, and number of its errors."""

    sorts: int
    errors: int


def sorting_run(decided: np.ndarray, label: np.ndarray, order: Iterable[int]) -> SortingRun:
    """Return the run that sorts recordings in an `order` (row numbers) until the first refusal.

    `decided` (n,) are decisions, and `label` (n,) numbers of the true classes.
    """
    rows = np.fromiter(order, int)
    refusals = np.flatnonzero(decided[rows] == STOP)
    if len(refusals):
        rows = rows[: refusals[0]]
    return SortingRun(len(rows), int(np.sum(decided[rows] != label[rows])))


def drawn_rows(label: np.ndarray, seed: int) -> np.ndarray:
    """Return row numbers (LONGEST_RUN,) of recordings with classes `label` (n,), drawn at random.

    Each draw has a random class, with equal probabilities, and a random recording of this class.
    """
    generator = np.random.default_rng(seed)
    by_class = np.argsort(label, kind="stable")
    counts = np.unique(label, return_counts=True)[1]
    first = np.cumsum(counts) - counts
    drawn = generator.integers(len(counts), size=LONGEST_RUN)
    return by_class[first[drawn] + generator.integers(counts[drawn])]
