"""Operators: whoever is told what to do at each grasp, and decides about a recording in doubt."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from ajgdata.acquire.protocol import PlannedGrasp
from ajgdata.types import Target


class Choice(StrEnum):
    """Decisions about a grasp."""

    KEEP = "keep"
    REDO = "redo"
    SKIP = "skip"
    QUIT = "quit"


class Decision(Exception):  # noqa: N818  # no error: it ends a question
    """The operator was asked for something else and decided this instead."""

    def __init__(self, choice: Choice) -> None:
        super().__init__(choice.value)
        self.choice = choice


@dataclass(frozen=True)
class Progress:
    """How far a session is, in grasps; `left_s` is None before the first one was timed."""

    done: int
    total: int
    left_s: float | None


@dataclass(frozen=True)
class Report:
    """One recording as the operator sees it. `usual_dbfs` is the median peak of the object's good
    recordings, `retakes` says why takes before it were thrown away."""

    grasp: PlannedGrasp
    sample: int
    peak_dbfs: float
    usual_dbfs: float | None
    problems: Sequence[str]
    retakes: Sequence[str]


class Operator(Protocol):
    """Asked and told, one call at a time. Methods that ask may raise Decision."""

    @property
    def attended(self) -> bool:
        """True if somebody is there who can mend things."""
        ...

    def announce(self, grasp: PlannedGrasp, progress: Progress) -> None:
        """Hear which grasp comes next."""
        ...

    def confirm(self, text: str) -> None:
        """Do what `text` says, and return when it is done."""
        ...

    def label(self, name: str, target: Target, grasp: PlannedGrasp) -> str:
        """Return the value of a target; "" if it is not known."""
        ...

    def show(self, report: Report) -> None:
        """See one recording."""
        ...

    def decide(self, problem: str, choices: Sequence[Choice]) -> Choice:
        """Return one of `choices` about a grasp with a problem."""
        ...

    def tell(self, text: str) -> None:
        """Hear what was decided without asking."""
        ...


class Unattended:
    """Nobody (`--yes`): keeps what is offered, tries a grasp three times, then leaves it out.

    Instead of leaving out a third grasp in a row it quits.
    """

    attended = False
    _LIMIT = 3

    def __init__(self, shown: Operator) -> None:
        self._shown = shown
        self._grasp, self._tries = "", 0
        self._in_a_row, self._left_out = 0, False

    def announce(self, grasp: PlannedGrasp, progress: Progress) -> None:
        """Show it."""
        if grasp.name != self._grasp:
            self._in_a_row = self._in_a_row if self._left_out else 0
            self._grasp, self._tries, self._left_out = grasp.name, 0, False
        self._tries += 1
        self._shown.announce(grasp, progress)

    def confirm(self, text: str) -> None:
        """Go on."""

    def label(self, name: str, target: Target, grasp: PlannedGrasp) -> str:
        """Return "": nobody knows."""
        return ""

    def show(self, report: Report) -> None:
        """Show it."""
        self._shown.show(report)

    def decide(self, problem: str, choices: Sequence[Choice]) -> Choice:
        """Keep it if that is offered, else try again, else leave it out, else quit; and say so."""
        choice = self._decided(choices)
        self._shown.tell(f"{problem}; {choice.value}")
        return choice

    def _decided(self, choices: Sequence[Choice]) -> Choice:
        if Choice.KEEP in choices:
            return Choice.KEEP
        if self._tries < self._LIMIT:
            return Choice.REDO
        self._left_out, self._in_a_row = True, self._in_a_row + 1
        return Choice.SKIP if self._in_a_row < self._LIMIT else Choice.QUIT

    def tell(self, text: str) -> None:
        """Show it."""
        self._shown.tell(text)
