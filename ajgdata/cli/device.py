"""The `ajgdata device` commands: sound cards listed and checked."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape

device = typer.Typer(
    no_args_is_help=True,
    help="Sound cards: which there are, and if one is fit to record with.",
)
out = Console(emoji=False, highlight=False)

_COLOURS = {"good": "green", "change": "yellow", "bad": "red"}


@device.command("list")
def list_command() -> None:
    """List the sound cards: name, channels, rates, API."""
    from ajgdata.pipeline.device import listed

    for line in listed():
        out.print(escape(line), soft_wrap=True)


@device.command()
def check(
    name: Annotated[str, typer.Argument(help="exact name, as `ajgdata device list` has it")],
    rate_hz: Annotated[int, typer.Option("--rate", min=1, help="samples per second")] = 44_100,
    output_channel: Annotated[int, typer.Option(min=1, help="the speaker's")] = 1,
    input_channel: Annotated[int, typer.Option(min=1, help="the microphone's")] = 1,
    loopback_channel: Annotated[
        int | None, typer.Option(min=1, help="input that a cable connects to the output")
    ] = None,
    drift_s: Annotated[
        float, typer.Option("--drift", min=0, help="seconds for the clocks; 0: leave them out")
    ] = 60.0,
) -> None:
    """Play sweeps and say if what comes back is fit to record. Exit code 1 if it is not.

    Speaker and microphone should be in the gripper as in a session, and the room quiet.
    """
    from ajgdata.acquire.card import card_settings
    from ajgdata.pipeline.device import check_device

    settings = card_settings(
        device=name,
        sample_rate_hz=rate_hz,
        output_channel=output_channel,
        input_channel=input_channel,
        loopback_channel=loopback_channel,
    )
    with out.status("opening") as status:
        checked = check_device(settings, drift_s=drift_s, progress=status.update)
    for topic, value in checked.facts().items():
        out.print(f"{topic:12} {escape(value)}", soft_wrap=True)
    for advice in checked.verdict:
        fix = f"; {advice.fix}" if advice.fix else ""
        colour = _COLOURS[advice.level]
        out.print(f"[{colour}]{advice.level:12}[/] {escape(advice.problem + fix)}", soft_wrap=True)
    raise typer.Exit(checked.verdict[0].level == "bad")
