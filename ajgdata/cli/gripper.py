"""The `ajgdata gripper` commands: look at scenes of the virtual gripper."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from rich.console import Console
from rich.markup import escape

gripper = typer.Typer(
    no_args_is_help=True,
    help="The virtual gripper: look at a scene, compare designs.\n\n"
    "A scene is a YAML or JSON file such as\n\n"
    "object: {kind: cube, edge_mm: 20, material: wood}\n\n"
    "medium: {kind: coffee}\n\n"
    "What is not said takes its default. The keys are gripper, medium, object, support, grasp, "
    "environment and numerics; gripper and object may be names, and a name alone is a scene.",
)
out = Console(emoji=False, highlight=False)

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
        out.print(escape(str(path)), soft_wrap=True)


@gripper.command("plan")
def plan_command(scene: SceneArgument) -> None:
    """Say what would be solved and what is left out, on which grid, at what cost."""
    from ajgdata.pipeline.show import plan_facts

    facts, parts = plan_facts(scene)
    for topic, said in facts.items():
        out.print(f"{topic:13} {escape(said)}", soft_wrap=True)
    out.print()
    for part in parts:
        kept = "solved" if part.kept else "[yellow]left out[/yellow]"
        effect = "" if part.effect is None else f"(changes at most {part.effect:.2g}) "
        out.print(f"{part.name:13} {kept}: {effect}{escape(part.why)}", soft_wrap=True)


@gripper.command()
def objects() -> None:
    """List the objects that have a name."""
    _print_library("objects")


@gripper.command()
def grippers() -> None:
    """List the grippers that have a name."""
    _print_library("grippers")


@gripper.command()
def design(
    spec: Annotated[Path, typer.Argument(metavar="SPEC.yaml", help="what may be chosen")],
    folder: Annotated[
        Path | None, typer.Option("--out", help="where to; default: design-<name of the file>")
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="list the designs and what they cost, solve nothing")
    ] = False,
    per_second: Annotated[
        bool, typer.Option("--per-second", help="rank by skill per CPU second of a scene")
    ] = False,
) -> None:
    """Rank designs of a gripper by how well sizes, angles and materials are read from them.

    Simulated, on the same grasps for all. SPEC.yaml names designs, or ranges to draw them from:

    designs: {drawn: {}, turned: {gripper: {microphone_mm: [20, -10]}}}

    ranges: {gripper.bed_depth_mm: [25, 45]}

    choices: {medium.kind: [plastic, coffee]}

    rows: [size_withheld, angle_withheld, sphere80]

    Settings by path stand in docs/parameters.md; further keys are draws, model, sessions, grasps,
    seed and quick.
    """
    from ajgdata.paths import find_project
    from ajgdata.pipeline.design import planned, rank_designs, read_design

    paths, wanted = find_project(), read_design(spec)
    said, scenes, seconds = planned(paths, wanted)
    if dry_run:
        for name, settings in said.items():
            out.print(f"{name:20} {escape(settings)}", soft_wrap=True)
    out.print(
        f"{len(said)} designs of {scenes} scenes each: about {seconds / 60:.1f} min of a core"
    )
    if dry_run:
        return
    table, files = rank_designs(
        paths,
        wanted,
        folder or Path(f"design-{spec.stem}"),
        "per_second" if per_second else "skill",
        lambda name: out.print(f"measured {escape(name)}"),
    )
    for row in table.rows:
        _print_design(row)
    for path in files:
        out.print(escape(str(path)), soft_wrap=True)


def _print_design(row: Mapping[str, Any]) -> None:
    if row["skill"] is None:
        said = f"cannot be read: {row['missing']}"
    else:
        said = (
            f"skill {row['skill']:.2f} ({row['low']:.2f} to {row['high']:.2f}), first in"
            f" {row['first']:.0f} %, {row['per_second']:.2f} per second of a scene"
        )
    out.print(f"{row['design']:20} {escape(said)}", soft_wrap=True)


def _print_library(kind: Literal["objects", "grippers"]) -> None:
    from ajgdata.pipeline.show import listed

    for name, said in listed(kind).items():
        out.print(f"{name:20} {escape(said)}", soft_wrap=True)
