"""`ajgdata device` and `ajgdata record`: list, check and use sound cards."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from ajgdata.acquire.signals import ended_by_signals
from ajgdata.cli.completion import dataset_names
from ajgdata.cli.console import ATTENTION, JsonOption, err, out, print_facts, print_json, say, warn
from ajgdata.paths import Paths, find_project
from ajgdata.types import DataError, checked
from ajgdata.types.extras import require_extra

if TYPE_CHECKING:
    from ajgdata.acquire.sound_card import CardCheck

device = typer.Typer(
    no_args_is_help=True,
    help="List and check sound cards.",
)

#: Panel of the help text for options of the sound card.
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
def list_command(as_json: JsonOption = False) -> None:
    """List the name, channels, default rate and API of each sound card."""
    from ajgdata.acquire.line import list_devices

    devices = list_devices()
    if not devices:
        raise DataError("PortAudio", "detects no sound card", "plug one in")
    if as_json:
        print_json({"devices": devices})
        return
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
    as_json: JsonOption = False,
) -> None:
    """Play sweeps and check the recorded response.

    Put speaker and microphone into the gripper as in a session, in a quiet room. Exit code 3 if
    the card cannot be used.
    """
    from ajgdata.acquire.card import CardSettings
    from ajgdata.acquire.sound_card import check_card, open_card

    settings = checked(
        CardSettings,
        "sound card",
        {
            "device": name,
            "sample_rate_hz": rate_hz,
            "output_channel": output_channel,
            "microphone": microphone,
        },
    )
    with err.status("playing sweeps, then silence: keep quiet"), open_card(settings) as card:
        result = check_card(card)
    is_unusable = result.clipped > 0 or result.snr_db < 0
    if as_json:
        issues = [{"problem": problem, "fix": fix} for problem, fix in result.issues]
        print_json(
            {**settings.model_dump(exclude={"attempts"}), **result._asdict(), "issues": issues}
        )
    else:
        _print_check(result)
    raise typer.Exit(ATTENTION if is_unusable else 0)


def _print_check(result: CardCheck) -> None:
    """Print the measurements of a sound card, and necessary changes."""
    latencies = ", ".join(str(latency) for latency in result.latency_samples)
    print_facts(
        {
            "latency": f"{latencies} samples",
            "level": f"peak {result.peak_dbfs:.1f} dBFS, {result.clipped} samples clipped",
            "noise": f"sweep {result.snr_db:.0f} dB above it",
        },
        width=11,
    )
    for problem, fix in result.issues:
        say(f"[yellow]change      [/] {escape(f'{problem}; {fix}')}")
    if not result.issues:
        say("[green]good        [/] the card is ready: record")


def project_for(source: str, device: str) -> Paths:
    """Return the project of a command that records with a sound card or the virtual gripper.

    Raises DataError for an unknown source, and for a sound card without its packages or `device`.
    """
    if source not in ("soundcard", "virtual"):
        raise DataError("--source", f"unknown value {source!r}", "use soundcard or virtual")
    paths = find_project()
    if source == "soundcard":
        require_extra("live", "--source soundcard")
        if not device:
            fix = 'add --device "…" (see `ajgdata device list`), or --source virtual'
            raise DataError("--source soundcard", "requires a device", fix)
    return paths


def record(
    dataset: Annotated[
        str, typer.Argument(help="data set with a protocol", autocompletion=dataset_names)
    ],
    device: Annotated[str, typer.Option(help="exact name in `ajgdata device list`")] = "",
    source: Annotated[str, typer.Option(help="soundcard, or virtual (no hardware)")] = "soundcard",
    session: Annotated[str, typer.Option(help="session; default: the incomplete session")] = "",
    microphone: MicrophoneOption = 1,
    output_channel: OutputChannel = 1,
    yes: Annotated[
        bool, typer.Option("--yes", help="run unattended: answer every prompt with the default")
    ] = False,
) -> None:
    """Record the missing grasps of a protocol.

    `--source virtual` tries the command without hardware, and the session is simulated. Safe to
    interrupt: run the same command again to resume. Exit code 3 if a grasp was skipped.
    """
    from ajgdata.acquire.operator import Operator, Unattended
    from ajgdata.pipeline.acquire_live import acquire_live

    paths = project_for(source, device)
    if source == "virtual":
        require_extra("simulate", "--source virtual")
        of_card = {
            "--device": device != "",
            "--microphone": microphone != 1,
            "--output-channel": output_channel != 1,
        }
        for option, is_given in of_card.items():
            if is_given:
                raise DataError(option, "is only used with --source soundcard", "remove it")
    operator = Unattended(out) if yes else Operator(out)
    card = {"device": device, "microphone": microphone, "output_channel": output_channel}
    try:
        with ended_by_signals():
            name, outcome = acquire_live(
                paths, dataset, session, source=source, device=card, operator=operator
            )
    except KeyboardInterrupt:
        say(f"stopped; recordings are kept: {_RESUME}")
        raise typer.Exit(130) from None
    remaining = "all grasps are recorded"
    if outcome.left:
        remaining = f"{outcome.left} grasps left: {_RESUME}"
    simulated = " (simulated)" if source == "virtual" else ""
    say(f"{dataset}/{name}{simulated}: {outcome.recorded} recorded, {remaining}")
    for grasp, reason in outcome.skipped.items():
        warn(f"[yellow]skipped[/yellow] {grasp}: {escape(reason)}")
    is_incomplete = bool(outcome.skipped) or (yes and outcome.left > 0)
    raise typer.Exit(ATTENTION if is_incomplete else 0)
