"""The `ajgdata device` commands: sound cards listed and checked."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.markup import escape

from ajgdata.cli.console import out, print_facts, say
from ajgdata.types import DataError

device = typer.Typer(
    no_args_is_help=True,
    help="Sound cards: which there are, and if one is fit to record with.",
)

_COLOURS = {"good": "green", "change": "yellow", "bad": "red"}


@device.command("list")
def list_command() -> None:
    """List the sound cards: name, channels, rates, API."""
    from ajgdata.acquire.line import list_devices

    devices = list_devices()
    if not devices:
        raise DataError("PortAudio", "finds no sound card", "plug one in")
    width = max(len(one["name"]) for one in devices)
    for one in devices:
        rates = " ".join(map(str, one["rates_hz"])) or "no usual rate"
        channels = f"{one['inputs']:3} in {one['outputs']:3} out"
        line = f"{one['name']:{width}}  {channels}  {rates} Hz  {one['api']}"
        say(escape(line))


@device.command()
def check(
    name: Annotated[str, typer.Argument(help="exact name, as `ajgdata device list` has it")],
    rate_hz: Annotated[int, typer.Option("--rate", min=1, help="samples per second")] = 44_100,
    output_channel: Annotated[int, typer.Option(min=1, help="the speaker's")] = 1,
    input_channel: Annotated[int, typer.Option(min=1, help="the microphone's")] = 1,
    loopback_channel: Annotated[
        int | None, typer.Option(min=1, help="input that a cable connects to the output")
    ] = None,
) -> None:
    """Play sweeps and check the recorded response. Exit code 1 if it is not fit for recording.

    Speaker and microphone should be in the gripper as in a session, and the room quiet.
    """
    from ajgdata.acquire.card import card_settings
    from ajgdata.acquire.card_check import check_card
    from ajgdata.acquire.line import open_card

    settings = card_settings(
        device=name,
        sample_rate_hz=rate_hz,
        output_channel=output_channel,
        input_channel=input_channel,
        loopback_channel=loopback_channel,
    )
    with out.status("opening") as status, open_card(settings) as card:
        checked = check_card(card, status.update)
    print_facts(checked.facts(), width=11)
    for advice in checked.verdict:
        fix = f"; {advice.fix}" if advice.fix else ""
        colour = _COLOURS[advice.level]
        say(f"[{colour}]{advice.level:12}[/] {escape(advice.problem + fix)}")
    raise typer.Exit(checked.verdict[0].level == "bad")
