"""What becomes of an object after one look at it, or several: the rules of a plan, nothing else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ajgdata.evaluate.sorting import combined, decide
from ajgdata.live.predictor import Prediction, Verdict
from ajgdata.types.plan import SortPlan


class Action(StrEnum):
    """What is done next."""

    PLACE = "place"
    AGAIN = "again"  #: let go and grasp it once more
    WAIT = "wait"  #: nothing is there: try later
    REJECT = "reject"
    STOP = "stop"


@dataclass(frozen=True)
class Decision:
    """A decision, and why.

    `value` is the most probable class ("" where no look is of a known thing), `bin` where the
    object goes ("" unless it is placed or rejected), `probability` that of each class after all
    `looks`.
    """

    action: Action
    value: str
    bin: str
    probability: Mapping[str, float]
    looks: int
    reason: str


def judge(looks: Sequence[Prediction], plan: SortPlan) -> Decision:
    """Return what becomes of an object that was sensed in `looks`, at least once, the last one now.

    Looks at what is known, or was not checked, are combined (`evaluate.sorting.combined`); the
    others are not, because their probabilities mean nothing. The last look says if anything is
    held.
    """
    last = looks[-1]
    usable = (Verdict.KNOWN, Verdict.NOT_CHECKED)
    known = [one for one in looks if one.verdict in usable]
    classes = list(last.probability)
    shares = combined(np.array([[one.probability[c] for c in classes] for one in known or looks]))
    probability = dict(zip(classes, shares.tolist(), strict=True))
    best = classes[int(np.argmax(shares))]
    left = len(looks) < plan.looks

    def decided(action: Action, reason: str, where: str = "") -> Decision:
        return Decision(action, best if known else "", where, probability, len(looks), reason)

    if last.verdict is Verdict.NOTHING:
        action = Action(plan.nothing)
        if action is Action.AGAIN and not left:
            action = Action.STOP
        return decided(action, "nothing is held")
    if last.verdict in usable:
        if decide(shares, plan.threshold) is not None:
            reason = f"{best}, {percent(probability[best])}"
            if last.verdict is Verdict.NOT_CHECKED:
                reason += ", novelty not checked"
            return decided(Action.PLACE, reason, plan.bins[best])
        reason = f"{best} has {percent(probability[best])}, needs {percent(plan.threshold)}"
        action = Action(plan.below)
    else:
        reason = f"unlike anything known, {last.novelty:.2g} times as far as grasps are"
        action = Action(plan.unknown)
    if left:
        return decided(Action.AGAIN, reason)
    return decided(action, reason, (plan.reject_bin or "") if action is Action.REJECT else "")


def percent(share: float) -> str:
    """Return a share as people read it; what is not all is never 100 %."""
    return f"{min(np.floor(1000 * share) / 10, 100):g} %"
