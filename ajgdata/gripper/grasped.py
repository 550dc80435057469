"""What of the grasped object is solved: the parts worth it, as walls and modes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.bending import PlateModes
from ajgdata.gripper.column import Bed, Body, StackModes, skin, solve
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
    skin_walls,
    stack_of,
)
from ajgdata.gripper.modes import NO_MODES, ModeList
from ajgdata.gripper.parts import OMEGA, Circuit, Complex, Part, Real
from ajgdata.gripper.plain import PartName
from ajgdata.gripper.scene import Numerics, Scene
from ajgdata.gripper.walls import NO_WALLS, WallList

#: No scene needs more modes; each costs a step as much as its cells do.
MOST_MODES = 12


@dataclass(frozen=True)
class Grasped:
    """The object's parts, and what they are on the grid."""

    parts: tuple[Part, ...]
    walls: WallList = NO_WALLS
    modes: ModeList = NO_MODES


def judged(numerics: Numerics, name: PartName, effect: float, what: str) -> Part:
    """A part that is kept if its effect reaches the tolerance, or if it is asked for."""
    asked = name in numerics.keep
    kept = asked or effect >= numerics.tolerance
    reason = "asked for" if asked else f"{effect:.2g} of {numerics.tolerance:g} allowed"
    return Part(name, kept, effect, f"{what}: {reason}")


def rigid(why: str) -> Grasped:
    """Nothing under the membrane gives way."""
    names: tuple[PartName, ...] = ("motion", "elastic", "compliance", "frame", "support")
    return Grasped(tuple(Part(name, False, None, why) for name in names))


def grasped(scene: Scene, shape: Cavity, cells: Cells, circuit: Circuit, where: Imprint) -> Grasped:
    """Decide on the object of `scene` by what its parts are worth in `circuit`."""
    body = body_of(scene, where, shape.force_n)
    if body is None:
        return rigid("the object is rigid")
    numerics, bed = scene.numerics, bed_of(scene, where, shape.force_n)
    wall = skin(body, scene.gripper.membrane.mass_kg_m2)
    alone = solve(stack_of(scene, body, None))
    through = circuit.modes(alone)
    compliance = judged(
        numerics, "compliance", circuit.effect(circuit.skin(wall)), "skin of the object"
    )
    motion = judged(numerics, "motion", circuit.effect(through[0]), _first(alone))
    bent = bending(scene, where, cells, body)
    bows = _bows(circuit, where, bent)
    higher = circuit.effect(through[1:].sum(0) + bows.sum(0))
    elastic = judged(numerics, "elastic", higher, "higher modes of the object")
    frame, coupled = _framed(scene, body, bed, circuit, through.sum(0))
    solved = alone if coupled is None else coupled
    if coupled is not None:
        why = "moves with the grains on it"
        motion, elastic = (Part(p.name, True, p.effect, why) for p in (motion, elastic))
    chosen = _worth(numerics, circuit, solved, [motion.kept, elastic.kept])
    support = _support(scene, [compliance, motion, elastic])
    solved_modes = mode_list(where, cells, solved, chosen) if len(chosen) else NO_MODES
    if bent is not None and elastic.kept:
        heard = np.array([circuit.effect(bow) for bow in bows])
        heavy = np.flatnonzero(heard >= min(numerics.tolerance, 0.01) / 2 / len(heard))
        solved_modes += bending_list(where, cells, *bent, heavy)
    return Grasped(
        (motion, elastic, compliance, frame, support),
        skin_walls(where, cells, wall) if compliance.kept else NO_WALLS,
        solved_modes,
    )


def _bows(circuit: Circuit, where: Imprint, bent: tuple[PlateModes, Real] | None) -> Complex:
    """Admittance of each bending mode: (N, ω)."""
    if bent is None:
        return np.zeros((0, len(OMEGA)), complex)
    modes, shapes = bent
    return circuit.piston(modes.square, modes.loss, shapes @ where.area / where.total)


def _first(modes: StackModes) -> str:
    return f"first mode of the object on its support, {np.sqrt(modes.square[0]) / 2 / np.pi:.0f} Hz"


def _framed(
    scene: Scene, body: Body, bed: Bed | None, circuit: Circuit, alone: Complex
) -> tuple[Part, StackModes | None]:
    """The path through the grains' frame, and the modes of the stack if it is kept."""
    if bed is None:
        return Part("frame", False, None, "no grains lie on the object"), None
    modes = solve(stack_of(scene, body, bed))
    effect = circuit.effect(circuit.modes(modes).sum(0) - alone)
    speed = np.sqrt(bed.frame.modulus_pa / bed.frame.density)
    what = f"stress through the grains, {speed:.0f} m/s over {1e3 * bed.depth:.0f} mm"
    part = judged(scene.numerics, "frame", effect, what)
    return part, modes if part.kept else None


def _worth(
    numerics: Numerics, circuit: Circuit, modes: StackModes, kept: list[bool]
) -> NDArray[np.int64]:
    """The modes to solve: of those kept, all but the weakest that stay below half the tolerance
    together."""
    wanted = np.concatenate([kept[:1], np.repeat(kept[1], len(modes.square) - 1)])
    within = modes.square < (1.5 * OMEGA[-1]) ** 2
    candidates = np.flatnonzero(wanted & within)
    effects = np.array([circuit.effect(y) for y in circuit.modes(modes)[candidates]])
    order = np.argsort(effects, kind="stable")
    light = order[np.cumsum(effects[order]) < min(numerics.tolerance, 0.01) / 2]
    heavy = np.setdiff1d(np.arange(len(candidates)), light)
    strongest = heavy[np.argsort(-effects[heavy], kind="stable")][:MOST_MODES]
    return np.sort(candidates[strongest])


def _support(scene: Scene, parts: list[Part]) -> Part:
    """The support is felt through the motion of the object, and solved with it."""
    if scene.support.kind == "rigid":
        return Part("support", False, None, "the ground is rigid")
    moves = any(part.kept for part in parts if part.name == "motion")
    return Part("support", moves, None, "felt as far as the object moves on it")


def where_grasped(scene: Scene, shape: Cavity, cells: Cells) -> Imprint | None:
    """The imprint of an object that is not rigid; None where nothing could give way."""
    if scene.object is None or scene.object.material == "rigid":
        return None
    found = imprint(shape, cells)
    return found if found.total else None
