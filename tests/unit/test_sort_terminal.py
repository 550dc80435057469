"""A person at a sorting run: questions, a terminal that is gone, and one line per object."""

import io

import pytest
from rich.console import Console
from sorting_lab import CLASSES

from ajgdata.live.sort import EndedByPerson
from ajgdata.live.steps import Control
from ajgdata.live.terminal import SortTerminal

START = {
    "n": 0, "time": "2026-01-02T03:04:05+00:00", "event": "start", "dataset": "d",
    "task": "t", "model": "cnn", "device": "fake", "classes": CLASSES,
    "threshold": 0.6, "source": "recorded",
}  # fmt: skip


class Person:
    """A terminal at which `lines` are typed, and which then is gone."""

    def __init__(self, monkeypatch, *lines):
        self.shown, self.control = io.StringIO(), Control()
        console = Console(file=self.shown, width=24, emoji=False, highlight=False)
        self.terminal = SortTerminal(console, self.control)
        self.terminal.tell(START)
        monkeypatch.setattr("sys.stdin", io.StringIO("".join(f"{line}\n" for line in lines)))


def test_a_person_confirms_or_ends_the_run(monkeypatch):
    Person(monkeypatch, "").terminal.confirm("put it into bin A")
    for lines in (["q"], []):
        with pytest.raises(EndedByPerson):
            Person(monkeypatch, *lines).terminal.confirm("press it")


def test_nobody_is_waited_for_when_it_halts(monkeypatch):
    person = Person(monkeypatch)
    person.control.end()
    person.terminal.confirm("stopped; take ball out of the gripper")
    assert "take ball out" in person.shown.getvalue()


EVENTS = [
    {"event": "grasp", "number": 1, "object": "cube"},
    {"event": "step", "step": "approach", "seconds": 1.5},
    {"event": "take", "seconds": 1.25, "clipped": 3},
    {"event": "prediction", "seconds": 0.25, "value": "ball", "probability": {"ball": 0.8}},
    {"event": "decision", "action": "place", "value": "ball"},
    {"event": "placed", "value": "ball", "bin": "A", "object": "cube"},
    {"event": "drift", "text": "the gripper has changed"},
    {"event": "stopped", "reason": "usb: went away; plug it in", "held": "ball", "sorts": 1},
]  # fmt: skip


def test_one_line_a_sort_and_what_matters_beside(monkeypatch):
    person = Person(monkeypatch)
    for n, event in enumerate(EVENTS, start=1):
        person.terminal.tell({"n": n, "time": START["time"], **event})
    lines = person.shown.getvalue().splitlines()[1:]
    assert lines[0].startswith("  3 samples clipped")
    assert lines[1] == "   1  ball, 80 %  → A  wrong: cube"
    assert lines[2] == "warning the gripper has changed"
    assert lines[3] == "ended: usb: went away; plug it in; still held: ball"
    assert len(lines) == 4
