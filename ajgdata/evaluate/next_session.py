"""Plan of the next session: rounds in which each class is placed once, in random order."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

#: Placements of each class in a session. Two are the smallest number with which a split within the
#: session can hold out a placement.
PLACEMENTS = 2
#: Grasps without a new placement. They differ less than placements, so few are enough.
GRASPS_PER_PLACEMENT = 3


class PlannedPlacement(NamedTuple):
    """One placement of an object, with its number of grasps. `step` counts from 1."""

    step: int
    label: str
    placement: int
    grasps: int


def next_session(labels: Sequence[str], seed: int = 0) -> list[PlannedPlacement]:
    """Return the placements of a session: each label once per round, in random order.

    With rounds, the time within the session says little about the label.

    >>> [(p.label, p.placement) for p in next_session(["ball", "cube"])]
    [('cube', 1), ('ball', 1), ('ball', 2), ('cube', 2)]
    """
    generator = np.random.default_rng(seed)
    planned: list[PlannedPlacement] = []
    for placement in range(1, PLACEMENTS + 1):
        for index in generator.permutation(len(labels)):
            step = len(planned) + 1
            label = labels[int(index)]
            planned.append(PlannedPlacement(step, label, placement, GRASPS_PER_PLACEMENT))
    return planned
