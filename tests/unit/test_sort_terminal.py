"""A person at a sorting run: questions, a terminal that is gone, and one line per object."""

import io

import pytest
from rich.console import Console
from sorting_lab import CLASSES

from ajgdata.live.sort import EndedByPerson
from ajgdata.live.steps import Control
from ajgdata.live.terminal import SortTerminal

START = {
    "n": 0,
    "time": "2026-01-02T03:04:05+00:00",
    "event": "start",
    "dataset": "d",
    "task": "t",
    "model": "cnn",
    "device": "fake",
    "classes": CLASSES,
    "threshold": 0.6,
    "source": "recorded",
}


class Person:
    """A terminal at which `lines` are typed, and which then is gone."""

    def __init__(self, monkeypatch, *lines):
        self.shown = io.StringIO()
        self.control = Control()
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


def test_a_run_begins_with_the_limits_of_its_novelty_check():
    note = "the novelty check detects only 32 % of novel objects"
    for about, expected in (({"novelty": note}, True), ({"novelty": ""}, False), ({}, False)):
        shown = io.StringIO()
        console = Console(file=shown, width=200, emoji=False, highlight=False)
        SortTerminal(console, Control()).tell(START | about)
        assert (f"note {note}" in shown.getvalue()) is expected
