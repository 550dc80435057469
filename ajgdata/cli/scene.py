"""`ajgdata scene`: draw a scene of the virtual gripper."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from ajgdata.cli.console import say
from ajgdata.types import DataError


def scene(
    dataset: Annotated[str, typer.Argument(help="data set with a recipe")],
    held: Annotated[str, typer.Argument(metavar="OBJECT", help="object of the recipe")],
    folder: Annotated[
        Path | None, typer.Option("--out", help="folder to write; default: results/exported")
    ] = None,
) -> None:
    """Draw the virtual gripper on an object of a recipe.

    Draws the cross-section of the object's first grasp as SVG, PNG and PDF files.
    """
    from ajgdata.acquire.recipe import plan_session, session_names
    from ajgdata.gripper import Scene
    from ajgdata.paths import find_project
    from ajgdata.report.canvas import save_figure
    from ajgdata.report.scenes import cross_section_figure
    from ajgdata.store.sessions import read_dataset

    paths = find_project()
    if not (recipe := read_dataset(paths, dataset).recipe):
        raise DataError(paths.dataset(dataset), "has no recipe", "choose a simulated data set")
    grasps = plan_session(recipe, dataset, session_names(recipe)[0], code="")
    setups = {grasp.object: grasp.setup for grasp in reversed(grasps)}
    if held not in setups:
        names = ", ".join(item.name for item in recipe.objects)
        raise DataError(paths.dataset(dataset), f"has no object {held!r}", f"use one of {names}")
    scene_of_grasp = Scene.model_validate(setups[held])
    figure = cross_section_figure(scene_of_grasp, f"{dataset}: {held}", held.replace("_", " "))
    for file in save_figure(figure, (folder or paths.exported) / f"{dataset}-{held}"):
        say(escape(str(file)))
