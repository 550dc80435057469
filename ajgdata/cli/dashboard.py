"""The command that shows a finished live run in a browser: `ajgdata dashboard`."""

from __future__ import annotations

from pathlib import Path
from threading import Event as Flag
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape

watching = typer.Typer()
out = Console(emoji=False, highlight=False)


@watching.command()
def dashboard(
    log: Annotated[Path, typer.Argument(help="log of a run (events.jsonl)")],
    port: Annotated[
        int, typer.Option(min=0, max=65_535, help="of the page; 0: any that is free")
    ] = 0,
) -> None:
    """Show how a run ended in a browser, until Ctrl-C: the page of a run with --dashboard."""
    from ajgdata.live.control import Control
    from ajgdata.live.dashboard import dashboard as served
    from ajgdata.live.events import read_events

    events = read_events(log)
    control = Control()
    with served(control, port=port) as shown:
        for event in events:  # the page shows that this is a replay
            shown.feed.tell({**event, "replay": True} if event["event"] == "start" else event)
        control.end()
        out.print(f"{len(events)} events: {escape(shown.address)}", soft_wrap=True)
        out.print("Ctrl-C ends it")
        try:
            Flag().wait()
        except KeyboardInterrupt:
            return
