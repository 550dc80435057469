"""The operator of an acquisition: a person at a terminal, or nobody.

Prompts and answers are plain lines, so the terminal can be an SSH connection or a pipe.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum

import numpy as np
from rich.console import Console
from rich.markup import escape

from ajgdata.acquire.protocol import PlannedGrasp

_METER = 20  # characters for 60 dB


class Choice(StrEnum):
    """Decisions about a grasp."""

    KEEP = "keep"
    REDO = "redo"
    SKIP = "skip"
    QUIT = "quit"


_KEYS = {"s": Choice.SKIP, "q": Choice.QUIT}


class OperatorDecision(Exception):  # noqa: N818  # not an error: it ends a prompt
    """The operator answered a prompt with a decision about the grasp."""

    def __init__(self, choice: Choice) -> None:
        super().__init__(choice.value)
        self.choice = choice


class Operator:
    """A person who reads lines and types answers. Prompts may raise OperatorDecision."""

    #: True if a person can correct problems.
    attended = True

    def __init__(self, console: Console) -> None:
        self._console = console

    def announce(self, grasp: PlannedGrasp, done: int, total: int) -> None:
        """Print the next grasp, and how many are `done`."""
        name = grasp.object or f"{grasp.reference} (reference)"
        self._print(f"[b]{done + 1} of {total}: {escape(name)}[/b], number {grasp.number}")

    def note(self, text: str) -> None:
        """Print a remark that needs no answer."""
        self._print(f"  [dim]{escape(text)}[/dim]")

    def confirm(self, text: str) -> None:
        """Print a request and wait for Enter. Raises OperatorDecision for s and q."""
        while True:
            reply = self._input(f"  {text}; then Enter (s: skip, q: quit) ")
            if not reply:
                return
            if reply in _KEYS:
                raise OperatorDecision(_KEYS[reply])

    def show(
        self,
        peak_dbfs: float,
        usual_dbfs: float | None,
        problems: Sequence[str],
        repeated: Sequence[str],
    ) -> None:
        """Print the peak of a recording, the usual peak of its object, and the reasons of repeated
        takes. The peak is red if there are problems."""
        for reason in repeated:
            self._print(f"  [yellow]repeated[/yellow] {escape(reason)}")
        colour = "red" if problems else "green"
        usual = "" if usual_dbfs is None else f" (usually {usual_dbfs:.1f})"
        self._print(f"  [{colour}]{meter(peak_dbfs)}[/{colour}] {peak_dbfs:6.1f} dBFS{usual}")

    def decide(self, problem: str, choices: Sequence[Choice]) -> Choice:
        """Print a problem and return the choice, which is typed in full or by its first letter."""
        self._print(f"  [red]{escape(problem)}[/red]")
        by_key = {choice.value[0]: choice for choice in choices}
        prompt = ", ".join(f"{key}: {choice.value}" for key, choice in by_key.items())
        while True:
            reply = self._input(f"  {prompt}? ").lower()
            if reply[:1] in by_key and by_key[reply[0]].value.startswith(reply):
                return by_key[reply[0]]

    def _print(self, text: str) -> None:
        self._console.print(text, soft_wrap=True)

    def _input(self, prompt: str) -> str:
        """Return the typed text. Ctrl-D, or a terminal that is closed, quits."""
        try:
            return self._console.input(escape(prompt)).strip()
        except EOFError:
            self._print("")
            raise OperatorDecision(Choice.QUIT) from None


class Unattended(Operator):
    """Nobody (`--yes`): keeps a grasp if possible, otherwise skips it."""

    attended = False

    def confirm(self, text: str) -> None:
        """Do nothing."""

    def decide(self, problem: str, choices: Sequence[Choice]) -> Choice:
        """Print a problem and the choice."""
        choice = Choice.KEEP if Choice.KEEP in choices else Choice.SKIP
        self._print(f"  [yellow]{escape(problem)}; {choice.value}[/yellow]")
        return choice


def meter(peak_dbfs: float) -> str:
    """Return a bar that is full at 0 dB of full scale and empty 60 dB below."""
    filled = int(np.clip(np.ceil(_METER * (1 + peak_dbfs / 60)), 0, _METER))
    return "█" * filled + "·" * (_METER - filled)
