"""The `ajgdata device` commands: sound cards, and the virtual gripper as one."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape

device = typer.Typer(
    no_args_is_help=True,
    help="Sound cards: which there are, and if one is fit to record with. `simulate` is one that "
    "needs no hardware.",
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


@device.command()
def simulate(
    scenes: Annotated[
        list[str],
        typer.Argument(metavar="SCENE...", help="as for `ajgdata gripper show`, or empty"),
    ],
    grasps: Annotated[
        int, typer.Option(min=0, help="of each SCENE that are solved beforehand")
    ] = 0,
    noise: Annotated[bool, typer.Option(help="with the microphone's own noise")] = True,
) -> None:
    """Be a sound card in whose gripper the first SCENE is heard, until Ctrl-C.

    Needs JACK (Debian: jackd2, libportaudio2), and no hardware. The others are ready to be switched
    to: `ajgdata device switch SCENE`.
    """
    from ajgdata.pipeline.simulated_device import simulate_card

    def ready(server: str) -> None:
        out.print(f'the device "virtual gripper" is there; scene {escape(scenes[0])}')
        out.print(f"other programs find it with JACK_DEFAULT_SERVER={server}; Ctrl-C ends it")

    out.print(f"solving {len(scenes)} scenes; the device is there when they are done ...")
    simulate_card(scenes, grasps=grasps, noise=noise, ready=ready)


@device.command()
def robot() -> None:
    """Be the robot of a protocol with the simulated card: one step, as JSON on standard input.

    In dataset.yaml: robot: command, robot_settings: {command: [ajgdata, device, robot]}.
    """
    import json
    import sys

    from ajgdata.types import DataError

    try:
        step = json.load(sys.stdin)
    except ValueError:
        raise DataError("standard input", "is no JSON", 'give {"step": "approach", ...}') from None
    if step.get("step") == "approach":  # the others change nothing, and should be quick
        from ajgdata.pipeline.simulated_device import robot_step

        robot_step(step)


@device.command("switch")
def switch_command(
    scene: Annotated[str, typer.Argument(help="as for `ajgdata gripper show`, or empty")],
    grasp: Annotated[
        int | None, typer.Option(min=0, help="number of a grasp: each is placed anew")
    ] = None,
) -> None:
    """Let the simulated card play another scene from now on."""
    from ajgdata.pipeline.simulated_device import switch_scene

    switch_scene(scene, grasp)
