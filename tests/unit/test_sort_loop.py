"""The sorting loop: its steps, what it keeps, and a safe end from every step of it."""

import itertools
import signal

import numpy as np
import pytest
from fake_card import FakeLine, Fault
from sorting_lab import (
    BALL,
    CUBE,
    EMPTY,
    ROD,
    STRANGE,
    UNSURE,
    Cell,
    Robot,
    Scripted,
    fails,
    interrupts,
    plan,
)

from ajgdata.acquire.card import CardError
from ajgdata.acquire.robot import RobotError, RobotGrasp
from ajgdata.live.sort import arrivals
from ajgdata.store.audio import read_audio
from ajgdata.store.sessions import read_recordings, read_session
from ajgdata.types import AudioSettings, PassiveRecording


@pytest.fixture
def cell(tmp_path):
    return Cell(tmp_path)


GIVEN = {"objects": ["ball", "cube", "rod"]}
ONE_SORT = ["loosen", "approach", "hold", "jam", "lift", "place", "release"]


def test_the_paper_s_sequence_object_by_object(cell):
    done = cell.run(plan(**GIVEN), BALL, CUBE, ROD)
    assert (len(done.placed), done.rows, done.mistakes) == (3, (3, 3), 0)
    assert done.stopped["finished"]
    assert cell.robot.names == ONE_SORT * 3
    assert [step[1] for step in cell.robot.steps if step[0] == "place"] == ["A", "B", "C"]
    assert cell.robot.steps[1] == ("approach", RobotGrasp("sort_0001", "ball", 1, 8.0))
    kinds = [event["event"] for event in cell.events()]
    once = ["grasp", *["step"] * 3, "take", "prediction", "decision", *["step"] * 4, "placed"]
    assert kinds == ["start", *once * 3, "stopped"]
    assert [event["n"] for event in cell.events()] == list(range(len(kinds)))
    last = cell.events("stopped")[0]
    assert (last["reason"], last["held"], last["sorts"]) == ("no object is left", "", 3)


def test_objects_are_sorted_by_sounds_that_nobody_played(cell):
    room = 1e-3 * np.random.default_rng(0).standard_normal(100_000)
    room[30_000] = 0.8
    cell.line = FakeLine(room=room)
    settings = PassiveRecording(length_s=0.2, trigger_dbfs=-20, pre_trigger_s=0.05)
    done = cell.run(plan(objects=["ball"]), BALL, played=settings)
    assert (len(done.placed), done.stopped["finished"]) == (1, True)
    (row,) = read_recordings(cell.folder)[0]
    recorded = read_audio(cell.folder / row.file, AudioSettings()).samples
    np.testing.assert_allclose(recorded, room[27_795:36_615], atol=2**-23)
    assert read_session(cell.folder).excitation is None


def test_an_object_in_doubt_stops_the_run_as_in_the_paper(cell):
    done = cell.run(plan(**GIVEN), BALL, UNSURE)
    assert (len(done.placed), done.stopped["finished"]) == (1, False)
    assert done.stopped["reason"] == "ball has 50 %, needs 60 %"
    assert cell.robot.names == [*ONE_SORT, "loosen", "approach", "hold", "release"]
    assert cell.events("stopped")[0]["held"] == ""


def test_nothing_held_waits_for_something(cell):
    sort_plan = plan(nothing="wait", wait_s=0.25, objects=["empty", "ball"])
    done = cell.run(sort_plan, EMPTY, BALL)
    assert len(done.placed) == 1
    waited = ["loosen", "approach", "hold", "release", "hold"]
    assert cell.robot.names == [*waited, *ONE_SORT]
    rows = read_recordings(cell.folder)[0]
    assert [(r.object, r.labels["reference"], r.quality) for r in rows] == [
        ("", "empty", "ok"),
        ("ball", "", "ok"),
    ]


def test_what_nobody_named_is_neither_a_reference_nor_trained_on(cell):
    cell.run(plan(sorts=1), BALL)
    (row,) = read_recordings(cell.folder)[0]
    assert (row.object, row.quality, "label" in row.labels) == ("", "reject", False)
    kept = {key: row.labels[key] for key in ("sort", "predicted", "confidence", "verdict")}
    assert list(kept.values()) == ["1", "ball", "0.9000", "known"]
    assert cell.robot.steps[1][1].object == "object"
    assert cell.events("grasp")[0]["object"] == ""


def test_a_known_object_is_labelled_and_its_mistakes_count(cell):
    done = cell.run(plan(**GIVEN), BALL, ROD, ROD)
    assert (len(done.placed), done.mistakes, done.rows) == (3, 1, (1, 1))
    rows = read_recordings(cell.folder)[0]
    assert [(r.object, r.labels["label"], r.labels["predicted"]) for r in rows] == [
        ("ball", "ball", "ball"),
        ("cube", "cube", "rod"),
        ("rod", "rod", "rod"),
    ]


def test_references_come_first_and_every_few_grasps(cell):
    sort_plan = plan(references={"every": 2}, sorts=5)
    predictions = (STRANGE, BALL, BALL, EMPTY, BALL, BALL, STRANGE, BALL)
    with cell.open(sort_plan, *predictions) as sorter:
        sorter.run()
        assert [f.shape for f in sorter.senses.references] == [(1, 129)] * 3
    events = cell.events("reference", "drift")
    # The first reference has none to be compared with.
    assert [e.get("verdict", e["event"]) for e in events] == [
        "unknown",
        "nothing",
        "unknown",
        "drift",
    ]
    rows = {r.recording_id: r for r in read_recordings(cell.folder)[0]}
    assert rows["empty_0003_1"].quality == "ok"
    assert rows["empty_0003_1"].labels["reference"] == "empty"


class Changed(Scripted):
    """A model with references, which does not recognise the gripper until it learns it."""

    has_references = True

    def with_references(self, features):
        return Scripted(BALL)


def test_each_reference_is_judged_by_the_model_as_it_was_loaded(cell):
    with cell.open(plan(references={"every": 1}, sorts=2), BALL) as sorter:
        sorter.senses = Changed(STRANGE)
        sorter.run()
    events = cell.events("reference", "drift")
    assert [e.get("verdict", e["event"]) for e in events] == ["unknown", "drift"] * 2


def test_arrivals_in_random_order_are_the_same_for_one_seed():
    sort_plan = plan(**GIVEN, order="random", seed=1)
    first = list(itertools.islice(arrivals(sort_plan), 300))
    assert first == list(itertools.islice(arrivals(sort_plan), 300))
    # 100 of each expected, of standard deviation 8.2: five of them.
    assert all(abs(first.count(name) - 100) < 41 for name in ("ball", "cube", "rod"))


HELD = {  # by step of the second sort, when it is interrupted in the middle
    "loosen": "",
    "approach": "cube",
    "hold": "cube",
    "jam": "cube",
    "lift": "cube",
    "place": "cube",
    "release": "",
}


@pytest.mark.parametrize("step, ends", [*((step, fails) for step in HELD), ("jam", interrupts)])
def test_every_step_can_be_the_last_and_the_robot_halts(cell, step, ends):
    """The second sort is ended in the middle of a step: the gripper halts with what it holds."""
    at = len(ONE_SORT) + ONE_SORT.index(step)
    cell.robot = Robot({at: ends})
    with pytest.raises(KeyboardInterrupt if ends is interrupts else RobotError):
        cell.run(plan(**GIVEN), BALL, CUBE)
    assert cell.robot.steps[at:] == [cell.robot.steps[at], ("halt", HELD[step])]
    assert_ended(cell, HELD[step], sorts=1)
    said = cell.events("stopped")[0]["reason"]
    assert said == ("stopped by a person" if ends is interrupts else "robot: stuck. Look at it.")


def assert_ended(cell, held, sorts):
    """One `stopped`, the last event; the session is whole and finished."""
    (stopped,) = cell.events("stopped")
    assert stopped == cell.events()[-1]
    assert (stopped["held"], stopped["sorts"]) == (held, sorts)
    assert cell.robot.names.count("halt") == 1
    assert cell.control.stopped
    if cell.folder.exists():
        assert read_session(cell.folder).acquisition.finished
        rows, findings = read_recordings(cell.folder)
        assert findings == [] and len(rows) == len(list((cell.folder / "audio").glob("*.wav")))


def test_a_card_that_goes_away_halts_the_robot(cell):
    cell.line = FakeLine(noise=1e-4, faults=[Fault(), Fault(unplugged=True)])
    with pytest.raises(CardError, match="went away"):
        cell.run(plan(**GIVEN), BALL, CUBE)
    assert cell.robot.names == [*ONE_SORT, "loosen", "approach", "hold", "halt"]
    assert_ended(cell, "cube", sorts=1)
    assert "went away" in cell.events("stopped")[0]["reason"]
    assert len(read_recordings(cell.folder)[0]) == 1


def test_a_robot_that_cannot_even_halt_is_said(cell):
    cell.robot = Robot({2: fails, 3: fails})
    with pytest.raises(RobotError):
        cell.run(plan(**GIVEN), BALL)
    assert cell.robot.names == ["loosen", "approach", "hold", "halt"]
    assert "did not halt: robot: stuck" in cell.events("problem")[0]["text"]
    assert_ended(cell, "ball", sorts=0)


def test_signals_while_it_halts_break_nothing(cell):
    """They come in the middle of `halt`, where nobody handles a second one."""

    def again():
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.raise_signal(number)
        cell.robot.steps.append(("halted",))

    cell.robot = Robot({2: fails, 3: again})
    with pytest.raises(RobotError):
        cell.run(plan(**GIVEN), BALL)
    assert cell.robot.names == ["loosen", "approach", "hold", "halt", "halted"]
    assert_ended(cell, "ball", sorts=0)


def test_a_stop_before_the_first_step_moves_nothing(cell):
    cell.control.stop()
    with pytest.raises(KeyboardInterrupt):
        cell.run(plan(**GIVEN), BALL)
    assert cell.robot.names == ["halt"]
    assert_ended(cell, "", sorts=0)
