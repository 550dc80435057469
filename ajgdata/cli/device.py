"""`ajgdata device` and `ajgdata record`: list and check sound cards, and record with them."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.markup import escape

from ajgdata.acquire.signals import ended_by_signals
from ajgdata.cli.console import ATTENTION, out, print_facts, say, warn
from ajgdata.types import DataError, checked

device = typer.Typer(
    no_args_is_help=True,
    help="List sound cards, or check one before recording.",
)

CARD_PANEL = "sound card"
_RESUME = "run the same command again to resume"
OutputChannel = Annotated[
    int,
    typer.Option(min=1, help="output channel of the speaker, from 1", rich_help_panel=CARD_PANEL),
]
MicrophoneOption = Annotated[
    int,
    typer.Option(min=1, help="input channel of the microphone, from 1", rich_help_panel=CARD_PANEL),
]


@device.command("list")
def list_command() -> None:
    """List the sound cards: name, channels, default rate, API."""
    from ajgdata.acquire.line import list_devices

    devices = list_devices()
    if not devices:
        raise DataError("PortAudio", "detects no sound card", "plug one in")
    width = max(len(card["name"]) for card in devices)
    for card in devices:
        channels = f"{card['inputs']:3} in {card['outputs']:3} out"
        line = f"{card['name']:{width}}  {channels}  {card['rate_hz']} Hz  {card['api']}"
        say(escape(line))


@device.command()
def check(
    name: Annotated[str, typer.Argument(help="exact name in `ajgdata device list`")],
    rate_hz: Annotated[int, typer.Option("--rate", min=1, help="samples per second")] = 44_100,
    output_channel: OutputChannel = 1,
    microphone: MicrophoneOption = 1,
) -> None:
    """Play sweeps and check the recorded response.

    Put speaker and microphone into the gripper as in a session, in a quiet room. Exit code 3 if
    the card cannot be used.
    """
    from ajgdata.acquire.card import CardSettings
    from ajgdata.acquire.sound_card import check_card, open_card

    channels = {"output_channel": output_channel, "microphone": microphone}
    keys = {"device": name, "sample_rate_hz": rate_hz, **channels}
    settings = checked(CardSettings, "sound card", keys)
    with out.status("playing sweeps, then silence: keep quiet"), open_card(settings) as card:
        measured = check_card(card)
    print_facts(
        {
            "latency": ", ".join(map(str, measured.latency_samples)) + " samples",
            "level": f"peak {measured.peak_dbfs:.1f} dBFS, {measured.clipped} samples clipped",
            "noise": f"sweep {measured.snr_db:.0f} dB above it",
        },
        width=11,
    )
    for issue in measured.issues:
        say(f"[yellow]change      [/] {escape(issue)}")
    if not measured.issues:
        say("[green]good        [/] the card is ready: record")
    raise typer.Exit(ATTENTION if measured.clipped or measured.snr_db < 0 else 0)


def record(
    dataset: Annotated[str, typer.Argument(help="data set with a protocol")],
    device: Annotated[str, typer.Option(help="exact name in `ajgdata device list`")],
    session: Annotated[str, typer.Option(help="session; default: the incomplete session")] = "",
    microphone: MicrophoneOption = 1,
    output_channel: OutputChannel = 1,
    yes: Annotated[
        bool, typer.Option("--yes", help="run unattended: answer every prompt with the default")
    ] = False,
) -> None:
    """Record the missing grasps of a protocol with a sound card.

    Safe to interrupt: run the same command again to resume. Exit code 3 if a grasp was skipped.
    """
    from ajgdata.acquire.operator import Operator, Unattended
    from ajgdata.paths import find_project
    from ajgdata.pipeline.acquire_live import acquire_live

    operator = Unattended(out) if yes else Operator(out)
    card = {"device": device, "microphone": microphone, "output_channel": output_channel}
    try:
        with ended_by_signals():
            name, done = acquire_live(
                find_project(), dataset, session, device=card, operator=operator
            )
    except KeyboardInterrupt:
        say(f"stopped; recordings are kept: {_RESUME}")
        raise typer.Exit(130) from None
    left = f"{done.left} grasps left: {_RESUME}" if done.left else "all grasps are recorded"
    say(f"{dataset}/{name}: {done.recorded} recorded, {left}")
    for grasp, reason in done.skipped.items():
        warn(f"[yellow]skipped[/yellow] {grasp}: {escape(reason)}")
    raise typer.Exit(ATTENTION if done.skipped or (yes and done.left) else 0)
