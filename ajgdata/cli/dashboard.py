"""The command that shows a live run after the fact: `ajgdata dashboard`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape

watching = typer.Typer()
out = Console(emoji=False, highlight=False)

PortOption = Annotated[
    int, typer.Option(min=0, max=65_535, help="of the page; 0: any that is free")
]


@watching.command()
def dashboard(
    log: Annotated[Path, typer.Argument(help="log of a run (events.jsonl)")],
    speed: Annotated[
        float,
        typer.Option(min=0, help="play it, so many times as fast as it was; 0: show its end"),
    ] = 0.0,
    port: PortOption = 0,
) -> None:
    """Show a run that is over in a browser, until Ctrl-C: how it ended, or played again.

    It is the page of a run with --dashboard; pause and stop are the replay's.
    """
    from ajgdata.live.replay import show_log

    def ready(address: str, events: int) -> None:
        out.print(f"{events} events: {escape(address)}", soft_wrap=True)
        out.print("Ctrl-C ends it")

    show_log(log, ready, speed=speed, port=port)
