"""The command that shows a finished live run in a browser: `ajgdata dashboard`."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from datetime import datetime
from pathlib import Path
from threading import Event as Flag
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.markup import escape

if TYPE_CHECKING:
    from ajgdata.live.control import Control
    from ajgdata.live.events import Event

watching = typer.Typer()
out = Console(emoji=False, highlight=False)

#: Longest pause between two events, in seconds.
LONGEST_S = 10.0


@watching.command()
def dashboard(
    log: Annotated[Path, typer.Argument(help="log of a run (events.jsonl)")],
    speed: Annotated[
        float,
        typer.Option(min=0, help="play it, so many times as fast as it was; 0: show its end"),
    ] = 0.0,
    port: Annotated[
        int, typer.Option(min=0, max=65_535, help="of the page; 0: any that is free")
    ] = 0,
) -> None:
    """Show a run that is over in a browser, until Ctrl-C: how it ended, or played again.

    It is the page of a run with --dashboard; pause and stop are the replay's.
    """
    from ajgdata.live.control import Control
    from ajgdata.live.dashboard import dashboard as served
    from ajgdata.live.events import read_events

    events = [
        {**event, "replay": True} if event["event"] == "start" else event
        for event in read_events(log)
    ]  # the page shows that this is a replay
    control = Control()
    with served(control, port=port) as shown:
        if speed:
            _print_address(shown.address, len(events))
        try:
            replay(events, shown.feed.tell, control, speed=speed)
            control.end()
            if not speed:  # the page then shows the end at once
                _print_address(shown.address, len(events))
            Flag().wait()
        except KeyboardInterrupt:
            pass


def replay(
    events: Iterable[Event],
    tell: Callable[[Event], object],
    control: Control,
    *,
    speed: float = 0.0,
    sleep: Callable[[float], object] = time.sleep,
) -> None:
    """Call `tell` with each event, `speed` times as fast as they came, or at once (0).

    Pauses with `control`, and ends when it is stopped.
    """
    before: datetime | None = None
    for event in events:
        now = datetime.fromisoformat(event["time"])
        if before is not None and speed:
            pause = max(0.0, (now - before).total_seconds()) / speed
            sleep(min(pause, LONGEST_S))
        before = now
        try:
            control.checkpoint()
        except KeyboardInterrupt:
            return
        tell(event)


def _print_address(address: str, events: int) -> None:
    out.print(f"{events} events: {escape(address)}", soft_wrap=True)
    out.print("Ctrl-C ends it")
