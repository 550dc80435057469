"""How long each stage of a live run took, by its log."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ajgdata.live.events import Event

#: Stages whose events are named otherwise than the stage, in the order in which they happen.
_STAGES = {"take": "sense", "prediction": "feature and prediction", "decision": "decision"}
#: Sense to decision: all of them, look by look.
TOTAL = "sense to decision"


@dataclass(frozen=True)
class Latency:
    """Times of a stage in s: median, 99th percentile (linear between the two next), how many."""

    median_s: float
    p99_s: float
    count: int


def latencies(events: Iterable[Event]) -> dict[str, Latency]:
    """Return the latency of each stage that `events` has: the robot's steps, `sense` (playing and
    recording), `feature and prediction`, `decision`, and `sense to decision`."""
    spent: dict[str, list[float]] = defaultdict(list)
    total = 0.0
    for event in events:
        kind = event["event"]
        if kind == "step":
            spent[str(event["step"])].append(event["seconds"])
        elif kind in _STAGES:
            total = event["seconds"] + (0.0 if kind == "take" else total)
            spent[_STAGES[kind]].append(event["seconds"])
            if kind == "decision":
                spent[TOTAL].append(total)
    return {stage: _latency(seconds) for stage, seconds in spent.items()}


def _latency(seconds: list[float]) -> Latency:
    return Latency(float(np.median(seconds)), float(np.percentile(seconds, 99)), len(seconds))
