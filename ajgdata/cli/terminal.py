"""The operator at a terminal: plain lines in, plain lines out, so that SSH and pipes will do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from rich.console import Console
from rich.markup import escape

from ajgdata.acquire.operator import Choice, Decision, Progress, Report
from ajgdata.acquire.protocol import PlannedGrasp
from ajgdata.types import Target

_METER = 20  # characters for 60 dB
_KEYS = {"s": Choice.SKIP, "q": Choice.QUIT}


class TerminalOperator:
    """A person who reads lines and types them (see acquire.operator.Operator)."""

    attended = True

    def __init__(self, console: Console) -> None:
        self._console = console

    def announce(self, grasp: PlannedGrasp, progress: Progress) -> None:
        """Print what comes, how far it is, and how long the rest takes."""
        what = grasp.object or f"{grasp.reference} (reference)"
        left = "" if progress.left_s is None else f", {_minutes(progress.left_s)} left"
        self._say(
            f"[b]{progress.done + 1} of {progress.total}[/b]{left}: [b]{escape(what)}[/b], "
            f"number {grasp.number}"
        )

    def confirm(self, text: str) -> None:
        """Print it and wait for Enter; s and q decide otherwise."""
        while True:
            reply = self._line(f"  {text}; then Enter (s: skip, q: quit) ")
            if not reply:
                return
            if reply in _KEYS:
                raise Decision(_KEYS[reply])

    def label(self, name: str, target: Target, grasp: PlannedGrasp) -> str:
        """Ask for a value until it is one; nothing is a value that is not known."""
        unit = f" in {target.unit}" if target.unit else ""
        whose = f"{grasp.object}, number {grasp.number}"
        while True:
            reply = self._line(f"  {name}{unit} of {whose} (Enter: not known) ")
            if target.kind == "classification" or reply in ("", *target.missing) or _number(reply):
                return reply
            self._say(f"  [red]{escape(reply)} is no number[/red]")

    def show(self, report: Report) -> None:
        """Print the peak level beside that of the object's earlier grasps."""
        for reason in report.retakes:
            self._say(f"  [yellow]repeated[/yellow] {escape(reason)}")
        colour = "red" if report.problems else "green"
        peak = report.peak_dbfs
        usual = "" if report.usual_dbfs is None else f" (usually {report.usual_dbfs:.1f})"
        self._say(f"  [{colour}]{meter(peak)}[/{colour}] {peak:6.1f} dBFS{usual}")

    def decide(self, problem: str, choices: Sequence[Choice]) -> Choice:
        """Print what is wrong and ask until the answer is a choice, or its first letter."""
        self._say(f"  [red]{escape(problem)}[/red]")
        by_key = {choice.value[0]: choice for choice in choices}
        offered = ", ".join(f"{key}: {choice.value}" for key, choice in by_key.items())
        while True:
            reply = self._line(f"  {offered}? ").lower()
            if reply[:1] in by_key and by_key[reply[0]].value.startswith(reply):
                return by_key[reply[0]]

    def tell(self, text: str) -> None:
        """Print a status message."""
        self._say(f"  [yellow]{escape(text)}[/yellow]")

    def _say(self, text: str) -> None:
        self._console.print(text, soft_wrap=True)

    def _line(self, prompt: str) -> str:
        """Return what was typed; Ctrl-D, or a terminal that is gone, quits."""
        try:
            return self._console.input(escape(prompt)).strip()
        except EOFError:
            self._say("")
            raise Decision(Choice.QUIT) from None


def meter(peak_dbfs: float) -> str:
    """Return a bar that is full at 0 dB of full scale and empty 60 dB below."""
    filled = int(np.clip(np.ceil(_METER * (1 + peak_dbfs / 60)), 0, _METER))
    return "█" * filled + "·" * (_METER - filled)


def _minutes(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.0f} min"


def _number(text: str) -> bool:
    try:
        return bool(np.isfinite(float(text)))
    except ValueError:
        return False
