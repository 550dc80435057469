"""`ajgdata acquire`: recordings through a sound card."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.markup import escape

from ajgdata.acquire.signals import ended_by_signals
from ajgdata.cli.console import out, say, warn
from ajgdata.cli.device import InputChannel, OutputChannel

_AGAIN = "run the same command again to resume"


def acquire(
    dataset: Annotated[str, typer.Argument(help="data set with a protocol")],
    device: Annotated[str, typer.Option(help="exact name, as `ajgdata device list` has it")],
    session: Annotated[str, typer.Option(help="session; default: the incomplete one")] = "",
    input_channel: InputChannel = 1,
    output_channel: OutputChannel = 1,
    yes: Annotated[
        bool, typer.Option("--yes", help="run unattended: answer each prompt by default")
    ] = False,
) -> None:
    """Record the missing grasps of a protocol with a sound card. Safe to interrupt.

    `ajgdata run` records recipes of the virtual gripper.
    """
    from ajgdata.acquire.operator import Operator, Unattended
    from ajgdata.paths import find_project
    from ajgdata.pipeline.acquire_live import acquire_live

    operator = Unattended(out) if yes else Operator(out)
    card = {"device": device, "input_channel": input_channel, "output_channel": output_channel}
    try:
        with ended_by_signals():
            name, done = acquire_live(
                find_project(), dataset, session, device=card, operator=operator
            )
    except KeyboardInterrupt:
        say(f"stopped; recordings are kept: {_AGAIN}")
        raise typer.Exit(130) from None
    left = f"{done.left} grasps left: {_AGAIN}" if done.left else "all grasps are recorded"
    say(f"{dataset}/{name}: {done.recorded} recorded, {left}")
    for grasp, reason in done.skipped.items():
        warn(f"[yellow]skipped[/yellow] {grasp}: {escape(reason)}")
    raise typer.Exit(bool(done.skipped or (yes and done.left)))
