"""The `ajgdata gripper` commands: look at scenes of the virtual gripper."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.markup import escape

from ajgdata.cli.console import print_facts, say

gripper = typer.Typer(
    no_args_is_help=True,
    help="The virtual gripper: look at a scene.\n\n"
    "A scene is a YAML or JSON file such as\n\n"
    "object: {kind: cube, edge_mm: 20, material: wood}\n\n"
    "medium: {kind: coffee}\n\n"
    "What is not said takes its default. The keys are gripper, medium, object, support, grasp, "
    "environment and numerics; gripper and object may be names, and a name alone is a scene.",
)

SceneArgument = Annotated[
    str, typer.Argument(metavar="SCENE", help="YAML or JSON file, or name of an object or gripper")
]


@gripper.command()
def show(
    scene: SceneArgument,
    folder: Annotated[
        Path | None, typer.Option("--out", help="where to; default: gripper-<name of the scene>")
    ] = None,
) -> None:
    """Draw a scene: its cross-section, its response and its spectrum."""
    from ajgdata.pipeline.show import show_scene

    for path in show_scene(scene, folder):
        say(escape(str(path)))


@gripper.command("plan")
def plan_command(scene: SceneArgument) -> None:
    """Print which parts are solved or omitted, on which grid, at which cost."""
    from ajgdata.pipeline.show import plan_facts

    facts, parts = plan_facts(scene)
    print_facts(facts, width=12)
    say("")
    for part in parts:
        kept = "solved" if part.kept else "[yellow]left out[/yellow]"
        effect = "" if part.effect is None else f"(changes at most {part.effect:.2g}) "
        say(f"{part.name:13} {kept}: {effect}{escape(part.why)}")


@gripper.command()
def objects() -> None:
    """List the objects that have a name."""
    _print_library("objects")


@gripper.command()
def grippers() -> None:
    """List the grippers that have a name."""
    _print_library("grippers")


def _print_library(kind: Literal["objects", "grippers"]) -> None:
    from ajgdata.pipeline.show import listed

    print_facts(listed(kind), width=19)
