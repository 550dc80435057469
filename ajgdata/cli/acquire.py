"""`ajgdata acquire`: recordings by the virtual gripper, or through a sound card."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from rich.markup import escape

from ajgdata.acquire.signals import ended_by_signals
from ajgdata.cli.console import out, say, warn
from ajgdata.cli.device import InputChannel, OutputChannel
from ajgdata.pipeline.progress import bar
from ajgdata.types import DataError

_CARD = "sound card"
_AGAIN = "run the same command again to resume"


def acquire(
    dataset: Annotated[
        list[str] | None, typer.Argument(help="data sets; default: all that have a recipe")
    ] = None,
    session: Annotated[
        str, typer.Option(help="session; default: all of the recipe, or the incomplete one")
    ] = "",
    device: Annotated[
        str,
        typer.Option(
            help="record the protocol of one data set with this sound card (exact name, see "
            "`ajgdata device list`); default: simulate recipes with the virtual gripper",
            rich_help_panel=_CARD,
        ),
    ] = "",
    input_channel: InputChannel = 1,
    output_channel: OutputChannel = 1,
    yes: Annotated[
        bool,
        typer.Option(
            "--yes", help="run unattended: answer each prompt by default", rich_help_panel=_CARD
        ),
    ] = False,
) -> None:
    """Record the missing grasps of recipes, or of a protocol. Safe to interrupt."""
    if not device:
        if yes or (input_channel, output_channel) != (1, 1):
            raise DataError("ajgdata acquire", "has options of a sound card", "add --device")
        _record_recipes(dataset or [], session)
    if len(dataset or []) != 1:
        raise DataError("--device", "needs one data set", "ajgdata acquire NAME --device …")
    card = {"device": device, "input_channel": input_channel, "output_channel": output_channel}
    _record_protocol((dataset or [""])[0], session, card, yes)


def _record_protocol(dataset: str, session: str, card: dict[str, Any], yes: bool) -> None:
    from ajgdata.acquire.operator import Operator, Unattended
    from ajgdata.paths import find_project
    from ajgdata.pipeline.acquire_live import acquire_live

    operator = Unattended(out) if yes else Operator(out)
    paths = find_project()
    try:
        with ended_by_signals():
            name, done = acquire_live(paths, dataset, session, device=card, operator=operator)
    except KeyboardInterrupt:
        say(f"stopped; recordings are kept: {_AGAIN}")
        raise typer.Exit(130) from None
    left = f"{done.left} grasps left: {_AGAIN}" if done.left else "all grasps are recorded"
    say(f"{dataset}/{name}: {done.recorded} recorded, {left}")
    _warn_skipped(done.skipped)
    raise typer.Exit(bool(done.skipped or (yes and done.left)))


def _record_recipes(datasets: list[str], session: str) -> None:
    from ajgdata.paths import find_project
    from ajgdata.pipeline.acquire import acquire_all
    from ajgdata.pipeline.recipes import recipe_sessions, with_recipe

    paths = find_project()
    sessions = [
        (dataset, name)
        for dataset in datasets or with_recipe(paths)
        for name in ([session] if session else recipe_sessions(paths, dataset))
    ]
    lines, skipped = [], 0
    with bar("recording") as started:
        for dataset, name, done in acquire_all(paths, sessions, started):
            _warn_skipped(done.skipped)
            skipped += len(done.skipped)
            left = f", {len(done.skipped)} grasps skipped" if done.skipped else ""
            counts = f"{done.recorded} recorded, {done.kept} already there{left}"
            lines.append(f"{dataset}/{name}: {counts}")
    for line in lines:
        say(line)
    raise typer.Exit(bool(skipped))


def _warn_skipped(skipped: Any) -> None:
    for grasp, reason in skipped.items():
        warn(f"[yellow]skipped[/yellow] {grasp}: {escape(reason)}")
