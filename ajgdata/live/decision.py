"""What happens to a sensed object: the rules of a plan, nothing else."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ajgdata.evaluate.sorting import decide
from ajgdata.live.predictor import Prediction, Verdict
from ajgdata.types.plan import SortPlan


class Action(StrEnum):
    """What is done next."""

    PLACE = "place"
    WAIT = "wait"  #: nothing is there: try later
    REJECT = "reject"
    STOP = "stop"


@dataclass(frozen=True)
class Decision:
    """A decision, and why.

    `value` is the most probable class ("" if the recording is not of a known class), `bin` where
    the object goes ("" unless it is placed or rejected).
    """

    action: Action
    value: str
    bin: str
    reason: str


def judge(prediction: Prediction, plan: SortPlan) -> Decision:
    """Return what happens to a sensed object."""
    if prediction.verdict is Verdict.NOTHING:
        return Decision(Action(plan.nothing), "", "", "nothing is held")
    best = str(prediction.value)
    if prediction.verdict is Verdict.UNKNOWN:
        best = ""
        reason = f"unlike anything known, {prediction.novelty:.2g} times as far as grasps are"
        action = Action(plan.unknown)
    else:
        probability = np.array(list(prediction.probability.values()))
        share = percent(float(probability.max()))
        if decide(probability, plan.threshold) is not None:
            unchecked = prediction.verdict is Verdict.NOT_CHECKED
            note = ", novelty not checked" if unchecked else ""
            return Decision(Action.PLACE, best, plan.bins[best], f"{best}, {share}{note}")
        reason = f"{best} has {share}, needs {percent(plan.threshold)}"
        action = Action(plan.below)
    where = (plan.reject_bin or "") if action is Action.REJECT else ""
    return Decision(action, best, where, reason)


def percent(share: float) -> str:
    """Return a share as people read it; what is not all is never 100 %."""
    return f"{min(np.floor(1000 * share) / 10, 100):g} %"
