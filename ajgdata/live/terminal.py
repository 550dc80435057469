"""A sorting run in a terminal: one line per object, and questions to the person."""

from __future__ import annotations

from rich.console import Console
from rich.markup import escape

from ajgdata.live.events import Event, RunState
from ajgdata.live.sort import EndedByPerson, percent
from ajgdata.live.steps import Control


class SortTerminal:
    """Shows a run line by line, and asks the person."""

    def __init__(self, console: Console, control: Control) -> None:
        self._console = console
        self._control = control
        self._state = RunState()

    def confirm(self, text: str) -> None:
        """Print a request to the person and wait for Enter; q ends the run."""
        if self._control.stopped:  # a run that ends does not wait for a person
            self._say(f"[b red]{escape(text)}[/]")
            return
        try:
            while True:
                answer = self._console.input(f"  {escape(text)}; then Enter (q: end) ").strip()
                if answer == "q":
                    raise EndedByPerson
                if not answer:
                    return
        except EOFError:
            raise EndedByPerson from None

    def tell(self, event: Event) -> None:
        """Show an event."""
        self._state.add(event)
        show = getattr(self, f"_{event['event']}", None)
        if show:
            show(event)

    def _say(self, text: str) -> None:
        self._console.print(text, soft_wrap=True)

    def _start(self, event: Event) -> None:
        simulated = " [b](simulated)[/b]" if event.get("source") == "simulated" else ""
        model = f"{event['dataset']}, {event['task']}, {event['model']}"
        self._say(
            f"sorting {escape(', '.join(event['classes']))} by {escape(model)} on "
            f"{escape(event['device'])}{simulated}; at {percent(event['threshold'])}; Ctrl-C stops"
        )
        note = event.get("novelty")
        if note:
            self._say(f"[yellow]note[/] {escape(note)}")

    def _take(self, event: Event) -> None:
        if event["clipped"]:
            self._say(f"  [yellow]{event['clipped']} samples clipped[/]: lower the gain")

    def _decision(self, event: Event) -> None:
        if event["action"] == "wait":
            number = self._state.grasps[-1].number
            self._say(f"[dim]{number:4}  {escape(event['reason'])}: wait[/]")

    def _placed(self, event: Event) -> None:
        value = event["value"] or "?"
        truth = event["object"]
        grasp = self._state.grasps[-1]
        if truth and truth != value:
            note = f"[red]wrong: {escape(truth)}[/]"
        else:
            note = f"{self._state.rows[0]} in a row"
        self._say(
            f"{grasp.number:4}  {escape(value)}, {percent(grasp.probability or 0.0)}"
            f"  → {escape(event['bin'])}  {note}"
        )

    def _reference(self, event: Event) -> None:
        self._say(f"[dim]      reference: {event['kind']}[/]")

    def _drift(self, event: Event) -> None:
        self._say(f"[b yellow]warning[/] {escape(event['text'])}")

    def _problem(self, event: Event) -> None:
        self._say(f"[yellow]warning[/] {escape(event['text'])}")

    def _stopped(self, event: Event) -> None:
        held = f"; [b red]still held: {escape(event['held'])}[/]" if event["held"] else ""
        self._say(f"[b]ended:[/b] {escape(event['reason'])}{held}")
