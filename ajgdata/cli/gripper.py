"""The `ajgdata gripper` commands: drawings and plans of scenes of the virtual gripper."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from ajgdata.cli.console import print_facts, say

if TYPE_CHECKING:
    from ajgdata.gripper import Plan, Scene

gripper = typer.Typer(
    no_args_is_help=True,
    help="The virtual gripper: draw or plan a scene.\n\n"
    "A scene is a YAML or JSON file such as\n\n"
    "object: {kind: cube, edge_mm: 20, material: wood}\n\n"
    "medium: {kind: coffee}\n\n"
    "Other settings have their default. The keys are gripper, medium, object, support, grasp, "
    "environment and numerics; gripper and object may be names, and a name alone is a scene.",
)
#: Object that is drawn in a gripper.
HELD = "cube_20p7"

SceneArgument = Annotated[
    str, typer.Argument(metavar="SCENE", help="YAML or JSON file, or name of an object or gripper")
]


@gripper.command()
def show(
    scene: SceneArgument,
    folder: Annotated[
        Path | None, typer.Option("--out", help="folder; default: gripper-<name of the scene>")
    ] = None,
) -> None:
    """Draw the cross-section of a scene."""
    from ajgdata.report.canvas import save_figure
    from ajgdata.report.scenes import cross_section_figure

    title, content = _open_scene(scene)
    _plan(scene, content)  # which checks the scene
    figure = cross_section_figure(content, title)
    path = (folder or Path(f"gripper-{title}")) / "cross-section"
    say(escape(str(save_figure(figure, path)[0])))


@gripper.command("plan")
def plan_command(scene: SceneArgument) -> None:
    """Print which parts are solved or omitted, on which grid, at which cost."""
    import numpy as np

    from ajgdata.report.format import number

    content = _open_scene(scene)[1]
    plan, numerics = _plan(scene, content), content.numerics
    system, cells = plan.system, np.count_nonzero(plan.system.mass)
    facts = {
        "grid": f"{number(numerics.dx_mm)} mm, {cells:,} open cells of {system.mass.size:,}",
        "time step": f"{1e6 * system.dt:.3f} µs, {plan.steps_per_sample} per sample",
        "steps": f"until {number(numerics.decay_db)} dB down, up to {plan.most_steps:,}",
        "memory": f"{number(plan.bytes / 1e6)} MB, {numerics.precision}",
        "displaced": f"{number(1e6 * plan.displaced_m3)} cm³ by the object",
        "volume added": f"{round(system.added_volume, 4) + 0.0:.2%}, to be stable",
        "tolerance": f"{number(numerics.tolerance)} for all omitted parts, by measurement",
    }
    print_facts(facts, width=12)
    say("")
    for part in plan.parts:
        state = "solved" if part.kept else "[yellow]omitted[/yellow]"
        effect = "" if part.effect is None else f" (changes up to {part.effect:.2g})"
        say(f"{part.name:13} {state}{effect}")


@gripper.command()
def names() -> None:
    """List the names of objects and grippers."""
    from ajgdata.gripper.grippers import GRIPPERS
    from ajgdata.gripper.object_library import OBJECTS

    print_facts({"objects": ", ".join(OBJECTS), "grippers": ", ".join(GRIPPERS)})


def _open_scene(name: str) -> tuple[str, Scene]:
    """Return title and scene of a file (YAML or JSON), or of an object or a gripper by its name.

    Raises DataError.
    """
    from ajgdata.gripper import Scene
    from ajgdata.gripper.grippers import GRIPPERS
    from ajgdata.gripper.object_library import OBJECTS
    from ajgdata.store.files import read_model
    from ajgdata.types import DataError

    path = Path(name)
    if path.is_file():
        return path.stem, read_model(path, Scene)
    if name in OBJECTS:
        return name, Scene.model_validate({"object": name})
    if name in GRIPPERS:
        return name, Scene.model_validate({"gripper": name, "object": HELD})
    raise DataError(name, "there is no such file, object or gripper", "see `ajgdata gripper names`")


def _plan(name: str, scene: Scene) -> Plan:
    """Return the plan of a scene. Raises DataError, in one line, for an impossible scene."""
    from ajgdata.gripper import SceneError, build_plan
    from ajgdata.types import DataError

    try:
        return build_plan(scene)
    except SceneError as error:
        problem, _, fix = str(error).partition(": ")
        raise DataError(name, problem, fix or "change the scene") from None
