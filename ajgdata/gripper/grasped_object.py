"""The parts of the grasped object, as walls and modes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.bending import PlateModes
from ajgdata.gripper.column import Bed, Body, StackModes, bent_modes, skin, solve
from ajgdata.gripper.film import Film, Skin, film_spring, gap_m
from ajgdata.gripper.geometry import Cavity
from ajgdata.gripper.grid import Cells
from ajgdata.gripper.mechanics import (
    Imprint,
    bed_of,
    bending,
    bending_list,
    body_of,
    imprint,
    mode_list,
    on_rim,
    ringing,
    skin_walls,
    stack_of,
)
from ajgdata.gripper.medium import Air
from ajgdata.gripper.modes import NO_MODES, ModeList
from ajgdata.gripper.omissions import Part, bounds, omitted
from ajgdata.gripper.scene import Scene
from ajgdata.gripper.scene_model import ObjectPart, PartName
from ajgdata.gripper.shell import ShellModes
from ajgdata.gripper.walls import NO_WALLS, WallList

Real = NDArray[np.floating]
#: Faster modes follow the sound as springs that hardly yield: the feature ends at 20 kHz, and has
#: 95 % of its energy below 14 kHz. Studies measure what is lost.
FASTEST_HZ = 21_000.0

#: Modes of what bends or rings, and their shapes over the imprint (N, columns).
Bent = tuple[PlateModes | ShellModes, Real] | None


@dataclass(frozen=True)
class Grasped:
    """The object's parts, and what they are on the grid."""

    parts: tuple[Part, ...]
    walls: WallList = NO_WALLS
    modes: ModeList = NO_MODES


def rigid(why: str) -> Grasped:
    """Nothing under the membrane gives way."""
    names: tuple[PartName, ...] = (*get_args(ObjectPart), "support")
    return Grasped(tuple(Part(name, False, None, why) for name in names))


def grasped(scene: Scene, shape: Cavity, cells: Cells, where: Imprint) -> Grasped:
    """Return the parts of the object of `scene`, and those that are solved as walls and modes."""
    held = body_of(scene, where, shape.force_n)
    if held is None:
        return rigid("the object is rigid")
    body, rest = held
    limits = bounds(scene)
    absent = omitted(scene, limits)
    bed = bed_of(scene, where, shape.force_n)
    grains = None if "frame" in absent else bed
    plate = on_rim(scene, where, cells, body)
    if plate is not None:
        stack = bent_modes(*plate, where.area, body, grains)
    else:
        stack = solve(stack_of(scene, body, rest, grains))
    # With the grains on it the object's modes are those of both.
    moves, rings = (grains is not None or part not in absent for part in ("motion", "elastic"))
    wanted = np.concatenate([[moves], np.repeat(rings, len(stack.square) - 1)])
    chosen = np.flatnonzero(wanted & _audible(stack.square))
    modes = mode_list(where, cells, stack, chosen) if len(chosen) else NO_MODES
    bent: Bent = bending(scene, where, cells, body, rest) or ringing(scene, where, cells)
    if bent is not None and rings:
        modes += bending_list(where, cells, *bent, np.flatnonzero(_audible(bent[0].square)))
    wall, film = _skins(scene, body)
    present: dict[ObjectPart, bool] = {
        "motion": moves,
        "elastic": rings,
        "compliance": "compliance" not in absent,
        "film": film is not None and "film" not in absent,
        "frame": grains is not None,
    }
    below = wall if present["compliance"] else None
    yielding = film.over(below) if film is not None and present["film"] else below
    walls = NO_WALLS if yielding is None else skin_walls(where, cells, yielding)
    told = _described(stack, bed, film)
    parts = [Part(name, solved, limits.get(name), told[name]) for name, solved in present.items()]
    return Grasped((*parts, _support(scene, moves or rings)), walls, modes)


def _skins(scene: Scene, body: Body) -> tuple[Skin, Film | None]:
    """The object's skin with the membrane on it, and the air between the two, if there is any."""
    membrane, gap, air = scene.gripper.membrane.mass_kg_m2, gap_m(scene), scene.environment
    wall = Skin(*skin(body, membrane))
    if not gap:
        return wall, None
    return wall, Film(gap, film_spring(gap, Air(air.temperature_c, air.pressure_pa)), membrane)


def _described(modes: StackModes, bed: Bed | None, film: Film | None) -> dict[ObjectPart, str]:
    first = np.sqrt(modes.square[0]) / (2 * np.pi)
    grains = "no grains lie on the object"
    if bed is not None:
        speed = np.sqrt(bed.frame.modulus_pa / bed.frame.density)
        grains = f"stress through the grains, {speed:.0f} m/s over {1e3 * bed.depth:.0f} mm"
    trapped = "no air is trapped"
    if film is not None:
        trapped = f"{1e6 * film.thickness:.3g} µm of air under the membrane"
    return {
        "motion": f"first mode of the object on its support, {first:.0f} Hz",
        "elastic": "higher modes of the object",
        "compliance": "skin of the object under the imprint",
        "film": trapped,
        "frame": grains,
    }


def _audible(square: Real) -> NDArray[np.bool_]:
    """Modes that are slow enough to be solved, by their ω²."""
    return square < (2 * np.pi * FASTEST_HZ) ** 2


def _support(scene: Scene, moves: bool) -> Part:
    """The support is felt through the motion and bending of the object, and solved with them."""
    if scene.support.kind == "rigid":
        return Part("support", False, None, "the ground is rigid")
    return Part("support", moves, None, "felt as far as the object moves on it")


def where_grasped(scene: Scene, shape: Cavity, cells: Cells) -> Imprint | None:
    """The imprint of an object that is not rigid; None where nothing could give way."""
    if scene.object is None or scene.object.material == "rigid":
        return None
    where = imprint(shape, cells)
    return where if where.total else None
