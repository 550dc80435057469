"""Drift of the gripper from its references, also where a model was trained without any."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ajgdata.live.drift import DriftWatch, references_needed

#: Share of false alarms that is allowed, at a given moment.
FALSE_ALARM = 0.01


class ReferenceWatch:
    """Compares references with those of the training, else with the first ones of the run.

    `known` (r, f) are features of the empty gripper that the model was trained with. If they are
    too few, the run's own join them until they are enough: a change before that goes unseen.
    """

    def __init__(self, known: NDArray[np.float32], false_alarm: float = FALSE_ALARM) -> None:
        self._false_alarm = false_alarm
        self._known = list(known)
        self._watch = self._made()

    @property
    def missing(self) -> int:
        """Return how many references are still to come before it watches."""
        return max(references_needed(self._false_alarm) - len(self._known), 0)

    def observe(self, feature: NDArray[np.float32]) -> float | None:
        """Return how far a reference (f,) is from what they were, 1 the alarm's limit; None while
        it still learns."""
        if self._watch is not None:
            return self._watch.observe(feature)
        self._known.append(feature)
        self._watch = self._made()
        return None

    def _made(self) -> DriftWatch | None:
        return None if self.missing else DriftWatch(np.array(self._known), self._false_alarm)
