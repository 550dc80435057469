"""What becomes of an object, by the rules of a plan."""

import pytest
from sorting_lab import BALL, CUBE, EMPTY, STRANGE, UNSURE, plan, seen

from ajgdata.live.decision import Action, judge


def test_the_threshold_itself_is_enough():
    at = judge([seen(0.6, 0.2, 0.2)], plan())
    assert (at.action, at.value, at.bin) == (Action.PLACE, "ball", "A")
    below = judge([seen(0.5999, 0.2001, 0.2)], plan())
    assert (below.action, below.bin) == (Action.STOP, "")
    assert below.reason == "ball has 59.9 %, needs 60 %"  # never said to have what it needs


def test_below_the_threshold_the_plan_may_reject():
    decision = judge([UNSURE], plan(below="reject", reject_bin="R"))
    assert (decision.action, decision.bin, decision.value) == ("reject", "R", "ball")


def test_another_look_before_anything_else_and_then_both_count():
    made = plan(looks=2)
    assert judge([UNSURE], made).action is Action.AGAIN
    both = judge([UNSURE, UNSURE], made)
    assert both.action is Action.PLACE  # .25 of .25 + .09 + .04: 66 %
    assert both.probability["ball"] == pytest.approx(0.25 / 0.38)
    assert judge([UNSURE, seen(0.2, 0.3, 0.5)], made).action is Action.STOP


def test_what_is_unlike_anything_is_looked_at_again_and_its_probabilities_are_left_out():
    made = plan(looks=3, unknown="reject", reject_bin="R")
    assert judge([STRANGE], made).action is Action.AGAIN
    assert judge([STRANGE, CUBE], made).value == "cube"  # .09 against .16 if it counted
    last = judge([STRANGE] * 3, made)
    assert (last.action, last.bin, last.value) == (Action.REJECT, "R", "")
    assert "2.5 times as far" in last.reason
    assert judge([UNSURE, UNSURE, STRANGE], made).action is Action.REJECT


@pytest.mark.parametrize(
    "rules, looks, action",
    [
        ({}, 1, "stop"),
        ({"nothing": "wait"}, 1, "wait"),
        ({"nothing": "wait", "looks": 3}, 2, "wait"),
        ({"nothing": "again", "looks": 2}, 1, "again"),
        ({"nothing": "again", "looks": 2}, 2, "stop"),
    ],
)
def test_nothing_held_is_no_class_however_probable(rules, looks, action):
    decision = judge([BALL] * (looks - 1) + [EMPTY], plan(**rules))
    assert (decision.action, decision.bin) == (action, "")
