"""`ajgdata gripper`: pictures of a scene in a folder, and the facts of its plan."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from ajgdata.gripper import Plan, Scene, SceneError, build_plan, simulate
from ajgdata.gripper.grippers import GRIPPERS
from ajgdata.gripper.object_library import OBJECTS
from ajgdata.gripper.objects import Material
from ajgdata.gripper.omissions import Part
from ajgdata.report.format import number
from ajgdata.store.responses import read_scene
from ajgdata.types import DataError

#: What a gripper is shown with.
HELD = "cube_20p7"


def open_scene(name: str) -> tuple[str, Scene]:
    """Return title and scene of a file (YAML or JSON), or of an object or a gripper by its name.

    Raises DataError.
    """
    path = Path(name)
    if path.is_file():
        return path.stem, read_scene(path)
    if name in OBJECTS:
        return name, Scene.model_validate({"object": name})
    if name in GRIPPERS:
        return name, Scene.model_validate({"gripper": name, "object": HELD})
    problem = "there is no such file, object or gripper"
    raise DataError(name, problem, "see `ajgdata gripper objects` and `ajgdata gripper grippers`")


def listed(kind: Literal["objects", "grippers"]) -> dict[str, str]:
    """Return the names of the library, each with a description."""
    if kind == "objects":
        return {
            name: f"{spec.category}: {spec.shape.title}, {_material(spec.shape.material)}"
            for name, spec in OBJECTS.items()
        }
    return {
        name: f"rim {number(2 * one.rim_radius_mm)} mm across, {number(one.height_mm)} mm high, "
        f"balloon {number(one.balloon_depth_mm)} mm deep, bed {number(one.bed_depth_mm)} mm"
        for name, one in GRIPPERS.items()
    }


def _material(material: str | Material) -> str:
    return material if isinstance(material, str) else f"{number(material.density_kg_m3)} kg/m³"


def planned(name: str, scene: Scene) -> Plan:
    """Return the plan of a scene. Raises DataError, in one line, for one that cannot exist."""
    try:
        return build_plan(scene)
    except SceneError as error:
        problem, _, fix = str(error).partition(": ")
        raise DataError(name, problem, fix or "change the scene") from None


def show_scene(name: str, out: Path | None = None) -> list[Path]:
    """Draw the cross-section of the scene `name`, and its response with the spectrum.

    Returns the SVG files in the folder `out`.
    """
    from ajgdata.report.canvas import save_figure
    from ajgdata.report.scenes import cross_section_figure, response_figure

    title, scene = open_scene(name)
    plan = planned(name, scene)
    folder = out or Path(f"gripper-{title}")
    figures = {
        "cross-section": cross_section_figure(scene, title, plan.left_out),
        "response": response_figure(simulate(plan), title, scene.numerics),
    }
    return [save_figure(figure, folder / stem)[0] for stem, figure in figures.items()]


def plan_facts(name: str) -> tuple[dict[str, str], Sequence[Part]]:
    """Return the cost of marching the scene `name`, by topic, and its parts, kept or left out."""
    _, scene = open_scene(name)
    plan = planned(name, scene)
    system, numerics = plan.system, scene.numerics
    cells = np.count_nonzero(system.mass)
    facts = {
        "scheme": numerics.scheme,
        "grid": f"{number(numerics.dx_mm)} mm, {cells:,} open cells of {system.mass.size:,}",
        "time step": f"{1e6 * system.dt:.3f} µs, {plan.steps_per_sample} a sample",
        "steps": f"until {number(numerics.decay_db)} dB down, {plan.most_steps:,} at most",
        "memory": f"{number(plan.bytes / 1e6)} MB, {numerics.precision}",
        "displaced": f"{number(1e6 * plan.displaced_m3)} cm³ by the object",
        "volume added": f"{round(system.added_volume, 4) + 0.0:.2%}, to be stable",
        "tolerance": f"{number(numerics.tolerance)} for all that is left out, by measurement",
    }
    return facts, plan.parts
