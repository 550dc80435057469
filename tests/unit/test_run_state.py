"""Events folded into what a page shows."""

import json

from live_events import CLASSES, Story

from ajgdata.live.run_state import GRASPS, OTHERS, PROBLEMS, UNSURE, RunState


def folded(events) -> RunState:
    """The state of a run after `events`."""
    state = RunState()
    for event in events:
        state.add(event)
    return state


def test_a_sort_is_counted_by_bin_truth_and_time():
    story = Story().start().sort(1, "marker", "marker").sort(2, "screw", "marker", sure=0.7)
    state = folded(story.events)
    assert state.n == len(story.events) - 1
    assert state.bins == {"A": 1, "B": 1}
    assert state.confusion == {"marker": {"marker": 1, "screw": 1}}
    assert (len(state.placed), state.rows, state.mistakes) == (2, (0, 1), 1)
    assert state.sort_s == 4.0  # take, prediction, decision, placed, one second each
    assert state.seconds == len(story.events) - 1.0
    last = state.grasps[-1]
    assert (last.value, last.probability, last.outcome, last.truth) == (
        "screw", 0.7, "screw", "marker",
    )  # fmt: skip


def undecided(truth, action):
    story = Story().start().say("grasp", number=1, object=truth)
    story.hear(dict.fromkeys(CLASSES, 0.25))
    about = {"value": "marker", "probability": dict.fromkeys(CLASSES, 0.25), "looks": 1}
    return story.say("decision", action=action, bin="R", reason="too unsure", **about)


def test_what_the_run_did_not_decide_itself_is_unsure():
    assert folded(undecided("screw", "stop").events).confusion == {"screw": {UNSURE: 1}}
    rejected = undecided("screw", "reject").say("placed", value="screw", bin="R", object="screw")
    assert folded(rejected.events).confusion == {"screw": {UNSURE: 1}}
    assert folded(undecided("empty", "stop").events).confusion == {}  # no mistake
    placed = folded(Story().start().sort(1, "marker", "empty").events)
    assert placed.confusion == {OTHERS: {"marker": 1}}


def test_a_row_ends_when_a_sort_was_wrong():
    story = Story().start().sort(1, "marker").sort(2, "screw", "screw").sort(3, "screw")
    assert folded(story.events).rows == (3, 3)
    story.sort(4, "screw", "marker")
    assert folded(story.events).rows == (0, 3)
    assert folded(story.sort(5, "screw", "screw").events).rows == (1, 3)


def test_drift_is_told_until_it_is_over():
    story = Story().start().say("drift", text="colder", ratio=1.4)
    assert folded(story.events).drift == {"text": "colder", "ratio": 1.4}
    story.say("reference", kind="empty", recording="r", drift=1.2)
    assert folded(story.events).drift == {"text": "colder", "ratio": 1.2}
    story.say("reference", kind="empty", recording="r", drift=None)
    story.say("reference", kind="empty", recording="r", drift=0.8)
    assert folded(story.events).drift == {"text": "", "ratio": 0.8}


def test_a_clock_that_is_set_back_gives_no_negative_time():
    story = Story().start().say("grasp", after=-3600.0, number=1, object="")
    assert folded(story.events).seconds == 0.0


def test_a_state_is_shown_as_json_with_the_last_grasps_only():
    story = Story().start()
    for number in range(1, GRASPS + 6):
        story.sort(number, "marker", "marker").say("problem", text=f"problem {number}")
    plain = json.loads(json.dumps(folded(story.events).plain(), allow_nan=False))
    assert [grasp["number"] for grasp in plain["grasps"]] == list(range(6, GRASPS + 6))
    assert len(plain["problems"]) == PROBLEMS
    assert plain["confusion"] == {"marker": {"marker": GRASPS + 5}}
    assert (plain["n"], plain["sorts"], plain["bins"]) == (
        len(story.events) - 1, GRASPS + 5, {"A": GRASPS + 5},
    )  # fmt: skip
