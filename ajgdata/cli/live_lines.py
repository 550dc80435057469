"""A live run in a terminal: bars, one line per object, and questions."""

from __future__ import annotations

from collections.abc import Sequence

from rich.cells import cell_len
from rich.console import Console
from rich.markup import escape

from ajgdata.live.control import Control, Mode
from ajgdata.live.decision import percent
from ajgdata.live.events import Event
from ajgdata.live.predictor import Prediction, Verdict
from ajgdata.live.run_state import RunState
from ajgdata.live.sort import EndedByPerson

_EIGHTHS = " ▏▎▍▌▋▊▉"
#: Widths of a bar, in characters; narrower terminals get none.
_WIDEST, _NARROWEST = 40, 8
_VERDICTS = {
    Verdict.KNOWN: ("green", "known"),
    Verdict.NOTHING: ("yellow", "nothing held"),
    Verdict.UNKNOWN: ("red", "unlike anything known"),
    Verdict.NOT_CHECKED: ("yellow", "novelty not checked"),
}


def bar(share: float, width: int, threshold: float | None = None) -> str:
    """Return a bar of `width` characters for a share of 1; `│` stands at the threshold."""
    eighths = round(max(0.0, min(share, 1.0)) * width * 8)
    drawn = list(("█" * (eighths // 8) + _EIGHTHS[eighths % 8]).ljust(width)[:width])
    if threshold is not None and 0 < threshold <= 1:
        at = min(int(threshold * width), width - 1)
        drawn[at] = "│" if drawn[at] == " " else "┃"
    return "".join(drawn)


def table_of(prediction: Prediction, width: int, threshold: float) -> list[str]:
    """Return the lines (rich markup) that show one prediction in `width` columns."""
    colour, verdict = _VERDICTS[prediction.verdict]
    if prediction.interval:
        low, high = prediction.interval
        unit = f" {prediction.unit}" if prediction.unit else ""
        value = f"{prediction.value:.4g}{unit}, between {low:.4g} and {high:.4g}"
    else:
        value = str(prediction.value)
    name_width = max((cell_len(name) for name in prediction.probability), default=0)
    room = min(width - name_width - 12, _WIDEST)
    lines = []
    ordered = sorted(prediction.probability.items(), key=lambda one: -one[1])
    for name, share in ordered:
        drawn = f"  {bar(share, room, threshold)}" if room >= _NARROWEST else ""
        strong = share >= threshold and prediction.verdict in (Verdict.KNOWN, Verdict.NOT_CHECKED)
        style = f"[{colour}]" if strong else "[dim]" if share < 0.01 else "[default]"
        lines.append(f"{style}{escape(name.ljust(name_width))}{drawn}  {percent(share):>7}[/]")
    if prediction.verdict is Verdict.KNOWN and ordered and ordered[0][1] < threshold:
        colour, verdict = "yellow", f"known, but below {percent(threshold)}"
    far = _novelty(prediction)
    named = "" if prediction.verdict is Verdict.NOTHING else f": [b]{escape(value)}[/b]"
    lines.append(f"[{colour}]{verdict}[/]{named}[dim]{far}[/dim]")
    return [*lines, *(f"[yellow]warning[/yellow] {escape(one)}" for one in prediction.remarks)]


def _novelty(prediction: Prediction) -> str:
    """Return the novelty, and how many novel objects the check detects, in brackets."""
    if prediction.novelty is None:
        return ""
    rate = prediction.detection_rate
    detects = "" if rate is None else f"; this check detects up to {percent(rate)} of novel objects"
    return f" (novelty {prediction.novelty:.2g}, limit 1{detects})"


class SortTerminal:
    """Shows a run line by line, and asks the person."""

    def __init__(self, console: Console, control: Control) -> None:
        self._console, self._control = console, control
        self._state = RunState()

    def confirm(self, text: str) -> None:
        """Say it and wait for Enter; q ends the run."""
        if self._control.mode is Mode.STOPPED:  # nobody is waited for now
            self._say(f"[b red]{escape(text)}[/]")
            return
        try:
            while answer := self._console.input(f"  {escape(text)}; then Enter (q: end) ").strip():
                if answer == "q":
                    raise EndedByPerson
        except EOFError:
            raise EndedByPerson from None

    def tell(self, event: Event) -> None:
        """Show an event."""
        self._state.add(event)
        show = getattr(self, f"_{event['event']}", None)
        if show:
            show(event)

    def summary(self) -> str:
        """Return how many went into which bin."""
        return ", ".join(f"{name} {count}" for name, count in sorted(self._state.bins.items()))

    @property
    def _classes(self) -> Sequence[str]:
        return self._state.plan.get("classes", ())

    def _say(self, text: str) -> None:
        self._console.print(text, soft_wrap=True)

    def _start(self, event: Event) -> None:
        kind = " [b](simulated)[/b]" if event.get("source") == "simulated" else ""
        what = f"{event['dataset']}, {event['task']}, {event['model']}"
        self._say(
            f"sorting {escape(', '.join(self._classes))} by {escape(what)} on "
            f"{escape(event['device'])}{kind}; at {percent(event['threshold'])}; Ctrl-C stops"
        )

    def _take(self, event: Event) -> None:
        if event["clipped"]:
            self._say(f"  [yellow]{event['clipped']} samples clipped[/]: lower the gain")

    def _decision(self, event: Event) -> None:
        if event["action"] in ("again", "wait"):
            number = self._state.grasps[-1].number
            self._say(f"[dim]{number:4}  {escape(event['reason'])}: {event['action']}[/]")

    def _placed(self, event: Event) -> None:
        value, truth = event["value"] or "?", event["object"]
        grasp = self._state.grasps[-1]
        wrong = truth and truth != value
        looks = f", {grasp.looks} looks" if grasp.looks > 1 else ""
        note = f"[red]wrong: {escape(truth)}[/]" if wrong else f"{self._state.rows[0]} in a row"
        self._say(
            f"{grasp.number:4}  {escape(value)}, {percent(grasp.probability or 0.0)}{looks}"
            f"  → {escape(event['bin'])}  {note}"
        )

    def _truth(self, event: Event) -> None:
        self._say(f"  [cyan]corrected[/] {event['number']} was {escape(event['object'])}")

    def _reference(self, event: Event) -> None:
        drift = event.get("drift")
        change = "" if drift is None else f", changed by {drift:.2g} of the limit"
        self._say(f"[dim]      reference: {event['kind']}{change}[/]")

    def _drift(self, event: Event) -> None:
        self._say(f"[b yellow]warning[/] {escape(event['text'])}")

    def _problem(self, event: Event) -> None:
        self._say(f"[yellow]warning[/] {escape(event['text'])}")

    def _paused(self, event: Event) -> None:
        self._say("[yellow]paused[/yellow]")

    def _resumed(self, event: Event) -> None:
        self._say("[yellow]resumed[/yellow]")

    def _stopped(self, event: Event) -> None:
        held = f"; [b red]still held: {escape(event['held'])}[/]" if event["held"] else ""
        self._say(f"[b]ended:[/b] {escape(event['reason'])}{held}")
