"""A person at a sorting run: questions, corrections while it goes on, a terminal that is gone."""

import io
import os
import threading
import time

import pytest
from rich.console import Console
from sorting_lab import CLASSES

from ajgdata.cli.live_lines import SortTerminal, Typed
from ajgdata.live.control import Control
from ajgdata.live.sort import EndedByPerson

START = {
    "n": 0, "time": "2026-01-02T03:04:05+00:00", "event": "start", "dataset": "d",
    "task": "t", "model": "cnn", "device": "fake", "classes": CLASSES,
    "threshold": 0.6, "source": "recorded",
}  # fmt: skip


class Person:
    """A terminal of 60 columns; `types` says what comes next, `gone` closes it."""

    def __init__(self, *, columns=60):
        self.shown = io.StringIO()
        self.control = Control()
        console = Console(file=self.shown, width=columns, emoji=False, highlight=False)
        self.terminal = SortTerminal(console, self.control)
        self.reading, self.writing = os.pipe()
        self.corrected = []
        self.terminal.correct = lambda value: self.corrected.append(value) or True
        self.terminal.tell(START)
        self.terminal.listen(self.reading)

    def answers(self, *lines):
        """Type each line when the next question has been asked."""
        threading.Thread(target=self._answer, args=(lines,), daemon=True).start()

    def _answer(self, lines):
        for asked, line in enumerate(lines, start=1):
            while self.shown.getvalue().count("q: end") < asked or not self.terminal._typed.waiting:
                time.sleep(0.005)
            self.types(line)

    def types(self, *lines):
        os.write(self.writing, "".join(f"{line}\n" for line in lines).encode())

    def gone(self):
        os.close(self.writing)


@pytest.fixture
def person():
    return Person()


def test_enter_is_enough(person):
    person.answers("")
    person.terminal.confirm("put it into bin A")
    assert "put it into bin A; then Enter" in person.shown.getvalue()


def test_a_class_at_a_question_corrects_the_last_sort_and_asks_again(person):
    person.answers("rod", "cu", "x", "")
    person.terminal.confirm("press it")
    assert person.corrected == ["rod", "cube"]  # by the beginning of its name, too
    assert "x is none of ball, cube, rod" in person.shown.getvalue()


def test_q_ends_it(person):
    person.answers("q")
    with pytest.raises(EndedByPerson):
        person.terminal.confirm("press it")


def test_q_ends_it_when_asked_for_a_class(person):
    person.answers("q")
    with pytest.raises(EndedByPerson):
        person.terminal.ask("ball has 50 %, needs 60 %", "ball")


@pytest.mark.parametrize(
    "typed, answer", [([""], "ball"), (["?"], None), (["dog", "r"], "rod"), (["cube"], "cube")]
)
def test_asked_what_it_is(person, typed, answer):
    person.answers(*typed)
    assert person.terminal.ask("ball has 50 %, needs 60 %", "ball") == answer


def test_a_terminal_that_is_gone_ends_it_and_every_further_question(person):
    person.gone()
    for _ in range(2):
        with pytest.raises(EndedByPerson):
            person.terminal.confirm("press it")


def test_nobody_knows_what_it_is_where_nobody_is(person):
    person.gone()
    assert person.terminal.ask("ball has 50 %, needs 60 %", "ball") is None


def test_a_correction_after_the_end_is_no_error(person):
    def closed(value):
        raise ValueError("write to closed file")

    person.terminal.correct = closed
    person.terminal._hear("rod")
    assert "nothing was placed" not in person.shown.getvalue()


def test_what_is_typed_while_nobody_asks_corrects(person):
    person.types("rod")
    for _ in range(500):
        if person.corrected:
            break
        time.sleep(0.01)
    assert person.corrected == ["rod"]


def test_nobody_is_waited_for_when_it_halts(person):
    """Nothing was typed: a question would never end."""
    person.control.end()
    person.terminal.confirm("stopped; take ball out of the gripper")
    assert "take ball out" in person.shown.getvalue()


def test_half_a_line_waits_for_its_other_half():
    heard = []
    reading, writing = os.pipe()
    Typed(heard.append, reading)
    for part in (b"ro", b"d\nba", b"ll\n"):
        os.write(writing, part)
        time.sleep(0.02)
    os.close(writing)
    for _ in range(500):
        if len(heard) == 2:
            break
        time.sleep(0.01)
    assert heard == ["rod", "ball"]


EVENTS = [
    {"event": "grasp", "number": 1, "object": "cube"},
    {"event": "step", "step": "approach", "seconds": 1.5},
    {"event": "take", "seconds": 1.25, "clipped": 3},
    {"event": "prediction", "seconds": 0.25},
    {"event": "decision", "action": "place", "value": "ball", "probability": {"ball": 0.8}},
    {"event": "placed", "value": "ball", "bin": "A", "object": "cube"},
    {"event": "drift", "text": "the gripper has changed", "ratio": 2.0},
    {"event": "stopped", "reason": "usb: went away; plug it in", "held": "ball", "sorts": 1},
]  # fmt: skip


@pytest.mark.parametrize("columns", [24, 60, 160])
def test_one_line_a_sort_and_what_matters_beside(columns):
    person = Person(columns=columns)
    for n, event in enumerate(EVENTS, start=1):
        person.terminal.tell({"n": n, "time": START["time"], **event})
    lines = person.shown.getvalue().splitlines()[1:]
    assert lines[0].startswith("  3 samples clipped")
    assert lines[1].startswith("   1  ball") and "80 %  → A  3.0 s  wrong: cube" in lines[1]
    assert ("█" in lines[1]) == (columns > 24)
    assert lines[2] == "warning the gripper has changed"
    assert lines[3] == "ended: usb: went away; plug it in; still held: ball"
    assert len(lines) == 4
    assert person.terminal.summary() == "A 1"
