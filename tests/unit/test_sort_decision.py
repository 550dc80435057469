"""What becomes of an object, by the rules of a plan."""

from dataclasses import replace

import pytest
from sorting_lab import BALL, EMPTY, STRANGE, UNSURE, plan, seen

from ajgdata.live.sort import Action, judge


def test_the_threshold_itself_is_enough():
    at = judge(seen(0.6, 0.2, 0.2), plan())
    assert (at.action, at.value, at.bin) == (Action.PLACE, "ball", "A")
    below = judge(seen(0.5999, 0.2001, 0.2), plan())
    assert (below.action, below.bin) == (Action.STOP, "")
    assert below.reason == "ball has 59.9 %, needs 60 %"  # never said to have what it needs


def test_below_the_threshold_the_plan_may_reject():
    decision = judge(UNSURE, plan(below="reject", reject_bin="R"))
    assert (decision.action, decision.bin, decision.value) == ("reject", "R", "ball")


def test_an_unknown_object_is_no_class_however_probable():
    assert judge(STRANGE, plan()).action is Action.STOP
    decision = judge(STRANGE, plan(unknown="reject", reject_bin="R"))
    assert (decision.action, decision.bin, decision.value) == (Action.REJECT, "R", "")
    assert decision.reason == "novel object: novelty 2.50, limit 1"


def test_without_a_novelty_check_an_object_is_placed_and_the_reason_says_so():
    decision = judge(seen(0.9, 0.05, 0.05, verdict="not checked", novelty=None), plan())
    assert (decision.action, decision.bin) == (Action.PLACE, "A")
    assert decision.reason == "ball, 90 %, novelty not checked"


@pytest.mark.parametrize(
    ("rate", "text"),
    [
        (0.3194, "this check detects 31.9 % of novel objects"),
        (None, "the detection rate of this check is not measured"),
    ],
)
def test_a_guard_that_misses_most_novel_objects_says_so(rate, text):
    prediction = replace(seen(0.9, 0.05, 0.05, verdict="no sign"), detection_rate=rate)
    decision = judge(prediction, plan())
    assert (decision.action, decision.bin) == (Action.PLACE, "A")
    assert decision.reason == f"ball, 90 %, no sign of a novel object ({text})"


@pytest.mark.parametrize("action", ["stop", "wait"])
def test_nothing_held_is_no_class_however_probable(action):
    assert BALL.probability == EMPTY.probability
    decision = judge(EMPTY, plan(nothing=action))
    assert (decision.action, decision.value, decision.bin) == (action, "", "")
