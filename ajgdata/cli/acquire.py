"""`ajgdata acquire`: recordings by the virtual gripper, or through a sound card."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from rich.markup import escape

from ajgdata.acquire.signals import ended_by_signals
from ajgdata.cli.console import out, say, warn
from ajgdata.pipeline.progress import bar
from ajgdata.types import SOURCES, DataError

SOUNDCARD = "soundcard"
_CARD = "sound card"


def acquire(
    context: typer.Context,
    dataset: Annotated[
        list[str] | None, typer.Argument(help="data sets; default: all that have a recipe")
    ] = None,
    source: Annotated[
        str,
        typer.Option(
            help="virtual: recipes of the physics simulation; soundcard: the protocol of a data "
            "set, with a real gripper; default: every recipe, by the source that it names"
        ),
    ] = "",
    session: Annotated[
        str,
        typer.Option(
            help="one session; default: all of the recipe, or the one that is not complete"
        ),
    ] = "",
    device: Annotated[
        str,
        typer.Option(help="exact name, as `ajgdata device list` has it", rich_help_panel=_CARD),
    ] = "",
    input_channel: Annotated[
        int, typer.Option(min=1, help="input channel of the microphone", rich_help_panel=_CARD)
    ] = 1,
    output_channel: Annotated[
        int, typer.Option(min=1, help="output channel of the speaker", rich_help_panel=_CARD)
    ] = 1,
    loopback_channel: Annotated[
        int | None,
        typer.Option(
            min=1, help="input that a cable connects to the output", rich_help_panel=_CARD
        ),
    ] = None,
    yes: Annotated[
        bool,
        typer.Option(
            "--yes",
            help="run unattended: answer every prompt with the default",
            rich_help_panel=_CARD,
        ),
    ] = False,
    notes: Annotated[str, typer.Option(help="notes for session.yaml", rich_help_panel=_CARD)] = "",
    temperature_c: Annotated[
        float | None, typer.Option(help="temperature of the room", rich_help_panel=_CARD)
    ] = None,
) -> None:
    """Record the missing grasps of a recipe or protocol. Safe to interrupt."""
    if source != SOUNDCARD:
        _refuse_card_options(context)
        _by_recipe(dataset or [], source, session)
        return
    if len(dataset or []) != 1 or not device:
        fix = f'ajgdata acquire NAME --source {SOUNDCARD} --device "…" (see `ajgdata device list`)'
        raise DataError(f"--source {SOUNDCARD}", "needs one data set and a device", fix)
    card = {
        "device": device,
        "input_channel": input_channel,
        "output_channel": output_channel,
        "loopback_channel": loopback_channel,
    }
    about = {"notes": notes, "temperature_c": temperature_c}
    _by_protocol((dataset or [""])[0], session, card, yes, about)


def _refuse_card_options(context: typer.Context) -> None:
    """Raise DataError for an option of the sound card: it would have no effect."""
    for option in context.command.params:
        origin = context.get_parameter_source(option.name or "")
        typed = origin is not None and origin.name == "COMMANDLINE"
        if typed and getattr(option, "rich_help_panel", None) == _CARD:
            fix = f"add --source {SOUNDCARD}"
            raise DataError(option.opts[0], f"is for a {_CARD}", fix)


def _by_protocol(
    dataset: str, session: str, device: dict[str, Any], yes: bool, about: dict[str, Any]
) -> None:
    from ajgdata.acquire.operator import Unattended
    from ajgdata.cli.terminal import TerminalOperator
    from ajgdata.paths import find_project
    from ajgdata.pipeline.acquire_live import acquire_live

    terminal = TerminalOperator(out)
    operator = Unattended(terminal) if yes else terminal
    again = "the same command goes on there"
    try:
        with ended_by_signals():
            name, done = acquire_live(
                find_project(), dataset, session,
                device=device, operator=operator, **about,
                allow=lambda text: _allowed(text, ask=not yes),
            )  # fmt: skip
    except KeyboardInterrupt:
        say(f"stopped; what was recorded is kept, {again}")
        raise typer.Exit(130) from None
    left = f", {done.left} grasps left; {again}" if done.left else ", all grasps are there"
    say(f"{dataset}/{name}: {done.recorded} recorded{left}")
    for grasp, reason in done.skipped.items():
        warn(f"[yellow]skipped[/yellow] {grasp}: {escape(reason)}")
    raise typer.Exit(bool(done.skipped or (yes and done.left)))


def _allowed(text: str, ask: bool) -> bool:
    """Show what a config would start, and return whether the user allows it."""
    say(escape(text))
    if not ask:
        return False
    try:
        return out.input("allow this program to run? (yes/no) ").strip().lower() == "yes"
    except EOFError:
        return False


def _by_recipe(datasets: list[str], source: str, session: str) -> None:
    from ajgdata.paths import find_project
    from ajgdata.pipeline.acquire import acquire_all
    from ajgdata.pipeline.recipes import recipe_sessions, with_recipe

    if source:
        try:
            SOURCES.checked(source)
        except ValueError as error:
            raise DataError("--source", str(error), f"or {SOUNDCARD}") from None
    paths = find_project()
    wanted = [
        (name, one)
        for name in datasets or with_recipe(paths, source)
        for one in ([session] if session else recipe_sessions(paths, name, source))
    ]
    said, skipped = [], 0
    with bar(f"recording ({source or 'recipes'})") as started:
        for name, one, done in acquire_all(paths, wanted, started):
            for grasp, reason in done.skipped.items():
                warn(f"[yellow]skipped[/yellow] {grasp}: {escape(reason)}")
            skipped += len(done.skipped)
            left = f", {len(done.skipped)} grasps skipped" if done.skipped else ""
            said.append(f"{name}/{one}: {done.recorded} recorded, {done.kept} already there{left}")
    for line in said:
        say(line)
    raise typer.Exit(bool(skipped))
