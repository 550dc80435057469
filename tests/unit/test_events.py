"""The log of a live run, and the state of the run that the events describe."""

import pytest
from live_events import CLASSES, Story, read_events

from ajgdata.live.events import UNSURE, EventLog, RunState


def test_events_are_written_line_by_line_and_passed_to_listeners(tmp_path):
    path = tmp_path / "run" / "events.jsonl"
    passed = []
    with EventLog(path) as log:
        log.listen(passed.append)
        log.say("start", dataset="ycb", classes=["marker", "screw"])
        assert read_events(path) == passed
        log.say("stopped", reason="weiß nicht", held="", sorts=0, seconds=1.5)
        with pytest.raises(ValueError, match="JSON compliant"):
            log.say("take", peak_dbfs=float("nan"))
    assert read_events(path) == passed
    assert [(event["n"], event["event"]) for event in passed] == [(0, "start"), (1, "stopped")]


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
    assert (len(state.placed), state.rows, state.mistakes) == (2, (0, 1), 1)
    assert state.seconds == len(story.events) - 1.0
    last = state.grasps[-1]
    assert (last.value, last.probability, last.outcome, last.truth) == (
        "screw",
        0.7,
        "screw",
        "marker",
    )


def undecided(truth, action):
    story = Story().start().say("grasp", number=1, object=truth)
    story.hear(dict.fromkeys(CLASSES, 0.25))
    return story.say("decision", action=action, value="marker", bin="R", reason="too unsure")


def test_what_the_run_did_not_decide_itself_is_unsure():
    def outcome(story):
        (grasp,) = folded(story.events).grasps
        return grasp.outcome, grasp.wrong

    assert outcome(undecided("screw", "stop")) == (UNSURE, False)
    rejected = undecided("screw", "reject").say("placed", value="", bin="R", object="screw")
    assert outcome(rejected) == (UNSURE, False)
    assert outcome(undecided("empty", "stop")) == ("", False)  # no mistake
    assert outcome(Story().start().sort(1, "marker", "empty")) == ("marker", True)


def test_a_row_ends_when_a_sort_was_wrong():
    story = Story().start().sort(1, "marker").sort(2, "screw", "screw").sort(3, "screw")
    assert folded(story.events).rows == (3, 3)
    story.sort(4, "screw", "marker")
    assert folded(story.events).rows == (0, 3)
    assert folded(story.sort(5, "screw", "screw").events).rows == (1, 3)


def test_drift_is_told_until_it_is_over():
    story = Story().start().say("reference", kind="empty", recording="r", verdict="unknown")
    story.say("drift", text="colder").sort(1, "marker")
    assert folded(story.events).drift == "colder"
    story.say("reference", kind="empty", recording="r", verdict="nothing")
    assert folded(story.events).drift == ""


def test_a_clock_that_is_set_back_gives_no_negative_time():
    story = Story().start().say("grasp", after=-3600.0, number=1, object="")
    assert folded(story.events).seconds == 0.0
