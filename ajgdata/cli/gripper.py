"""The `ajgdata gripper` commands: drawings of scenes of the virtual gripper."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from ajgdata.cli.console import print_facts, say
from ajgdata.types import DataError

if TYPE_CHECKING:
    from ajgdata.gripper import Scene

gripper = typer.Typer(
    no_args_is_help=True,
    help="The virtual gripper: draw a scene.\n\n"
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
    from ajgdata.gripper import SceneError, build_plan
    from ajgdata.report.canvas import save_figure
    from ajgdata.report.scenes import cross_section_figure

    title, content = _open_scene(scene)
    try:
        build_plan(content)  # checks the scene
    except SceneError as error:
        problem, _, fix = str(error).partition(": ")
        raise DataError(scene, problem, fix or "change the scene") from None
    figure = cross_section_figure(content, title)
    path = (folder or Path(f"gripper-{title}")) / "cross-section"
    say(escape(str(save_figure(figure, path)[0])))


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

    path = Path(name)
    if path.is_file():
        return path.stem, read_model(path, Scene)
    if name in OBJECTS:
        return name, Scene.model_validate({"object": name})
    if name in GRIPPERS:
        return name, Scene.model_validate({"gripper": name, "object": HELD})
    raise DataError(name, "there is no such file, object or gripper", "see `ajgdata gripper names`")
