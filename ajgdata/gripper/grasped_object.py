"""The parts of the grasped object that are worth solving, as walls and modes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.bending import PlateModes
from ajgdata.gripper.column import Bed, Body, StackModes, skin, solve
from ajgdata.gripper.effect_estimates import FURTHEST, OMEGA, Circuit, Complex, Part, Real
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
from ajgdata.gripper.plate_column import bent_modes
from ajgdata.gripper.scene import Numerics, Scene
from ajgdata.gripper.scene_model import PartName
from ajgdata.gripper.shell import ShellModes
from ajgdata.gripper.walls import NO_WALLS, WallList

#: Over an imprint of a few grains the circuit errs by as much on top, of the frame alone (measured
#: in studies/omissions.py).
FRAME_SAFETY = 6.0
#: No scene needs more modes; each costs a step as much as its cells do.
MOST_MODES = 12


#: Modes of what bends or rings, and their shapes over the imprint (N, columns).
Bent = tuple[PlateModes | ShellModes, Real] | None


@dataclass(frozen=True)
class Grasped:
    """The object's parts, and what they are on the grid."""

    parts: tuple[Part, ...]
    walls: WallList = NO_WALLS
    modes: ModeList = NO_MODES


def spared(effects: dict[PartName, float], numerics: Numerics) -> set[PartName]:
    """Return the parts to leave out: those of least effect that together stay below the tolerance
    (root of the sum of squares; no two features differ by more than FURTHEST), none asked for.
    """
    left_out: set[PartName] = set()
    total = 0.0
    for name in sorted(effects, key=lambda name: effects[name]):
        if name in numerics.keep:
            continue
        total = float(np.hypot(total, effects[name]))
        if min(total, FURTHEST) < numerics.tolerance:
            left_out.add(name)
    return left_out


def judged(
    effects: dict[PartName, float], numerics: Numerics, what: dict[PartName, str]
) -> dict[PartName, Part]:
    """Return each part with its effect, kept or not, and why."""
    left_out = spared(effects, numerics)
    parts = {}
    for name, effect in effects.items():
        why = f"{what[name]}, asked for" if name in numerics.keep else what[name]
        parts[name] = Part(name, name not in left_out, effect, why)
    return parts


def rigid(why: str) -> Grasped:
    """Nothing under the membrane gives way."""
    names: tuple[PartName, ...] = ("motion", "elastic", "compliance", "film", "frame", "support")
    return Grasped(tuple(Part(name, False, None, why) for name in names))


def grasped(scene: Scene, shape: Cavity, cells: Cells, circuit: Circuit, where: Imprint) -> Grasped:
    """Decide on the object of `scene` by what its parts are worth in `circuit`."""
    held = body_of(scene, where, shape.force_n)
    if held is None:
        return rigid("the object is rigid")
    body, rest = held
    numerics, bed = scene.numerics, bed_of(scene, where, shape.force_n)
    wall, film = _skins(scene, body)
    plate = on_rim(scene, where, cells, body)

    def modes_with(grains: Bed | None) -> StackModes:
        if plate is not None:
            return bent_modes(*plate, where.area, body, grains)
        return solve(stack_of(scene, body, rest, grains))

    alone = modes_with(None)
    coupled = None if bed is None else modes_with(bed)
    through = _through(circuit, where, alone)
    bent: Bent = bending(scene, where, cells, body, rest) or ringing(scene, where, cells)
    bows = _bows(circuit, where, bent)
    effects: dict[PartName, float] = {
        "motion": circuit.effect(through[0]),
        "elastic": circuit.effect(through[1:].sum(0) + bows.sum(0)),
    }
    effects |= _skin_effects(circuit, wall, film)
    if coupled is not None:
        change = circuit.effect(_through(circuit, where, coupled).sum(0) - through.sum(0))
        effects["frame"] = min(FRAME_SAFETY * change, FURTHEST)
    parts = judged(effects, numerics, _described(alone, bed, film))
    parts.setdefault("film", Part("film", False, None, "no air is trapped"))
    if coupled is None:
        parts["frame"] = Part("frame", False, None, "no grains lie on the object")
    elif parts["frame"].kept:
        why = "moves with the grains on it"
        for name in ("motion", "elastic"):
            parts[name] = replace(parts[name], kept=True, why=why)
    solved = coupled if coupled is not None and parts["frame"].kept else alone
    chosen = _worth(numerics, circuit, where, solved, [parts["motion"].kept, parts["elastic"].kept])
    modes = mode_list(where, cells, solved, chosen) if len(chosen) else NO_MODES
    if bent is not None and parts["elastic"].kept:
        heavy = np.flatnonzero(_heard(numerics, circuit, bows) & _within(bent[0].square))
        heavy = _strongest(circuit, bows, heavy)
        modes += bending_list(where, cells, *bent, heavy) if len(heavy) else NO_MODES
    yielding = _yielding(parts, wall, film)
    walls = NO_WALLS if yielding is None else skin_walls(where, cells, yielding)
    solved_by = parts["motion"].kept or (bent is not None and parts["elastic"].kept)
    return Grasped((*parts.values(), _support(scene, solved_by)), walls, modes)


def _skins(scene: Scene, body: Body) -> tuple[Skin, Film | None]:
    """The object's skin with the membrane on it, and the air between the two, if there is any."""
    membrane, gap, air = scene.gripper.membrane.mass_kg_m2, gap_m(scene), scene.environment
    wall = Skin(*skin(body, membrane))
    if not gap:
        return wall, None
    return wall, Film(gap, film_spring(gap, Air(air.temperature_c, air.pressure_pa)), membrane)


def _skin_effects(circuit: Circuit, wall: Skin, film: Film | None) -> dict[PartName, float]:
    """What the object's skin is worth, alone and below the film, and what the film is."""
    alone = circuit.skin(wall)
    if film is None:
        return {"compliance": circuit.effect(alone)}
    both, hard = circuit.skin(film.over(wall)), circuit.skin(film.over(None))
    below = max(circuit.effect(alone), circuit.effect(both - hard))
    return {"compliance": below, "film": circuit.effect(both - alone)}


def _yielding(parts: dict[PartName, Part], wall: Skin, film: Film | None) -> Skin | None:
    """What gives way under the sound, of skin and film as far as they are kept."""
    below = wall if parts["compliance"].kept else None
    return film.over(below) if film is not None and parts["film"].kept else below


def _through(circuit: Circuit, where: Imprint, modes: StackModes) -> Complex:
    """Admittance of each mode of the column, seen at the surface of the grains: (N, ω)."""
    if modes.foot is None:
        return circuit.modes(modes)
    uneven = (modes.foot - modes.shape[:, :1]) ** 2 @ where.area / where.total
    return circuit.modes(modes) + circuit.uneven(modes.square, modes.loss, np.sqrt(uneven))


def _bows(circuit: Circuit, where: Imprint, bent: Bent) -> Complex:
    """Admittance of each bending mode: (N, ω)."""
    if bent is None:
        return np.zeros((0, len(OMEGA)), complex)
    modes, shapes = bent
    mean = shapes @ where.area / where.total
    uneven = (shapes - mean[:, None]) ** 2 @ where.area / where.total
    return circuit.bent(modes.square, modes.loss, mean, np.sqrt(uneven))


def _described(alone: StackModes, bed: Bed | None, film: Film | None) -> dict[PartName, str]:
    first = np.sqrt(alone.square[0]) / (2 * np.pi)
    grains = ""
    if bed is not None:
        speed = np.sqrt(bed.frame.modulus_pa / bed.frame.density)
        grains = f"stress through the grains, {speed:.0f} m/s over {1e3 * bed.depth:.0f} mm"
    return {
        "motion": f"first mode of the object on its support, {first:.0f} Hz",
        "elastic": "higher modes of the object",
        "compliance": "skin of the object under the imprint",
        "film": "" if film is None else f"{1e6 * film.thickness:.3g} µm of air under the membrane",
        "frame": grains,
    }


def _within(square: Real) -> NDArray[np.bool_]:
    """Modes that the band of the feature can excite; faster ones follow as springs too stiff to
    matter."""
    return square < (1.5 * OMEGA[-1]) ** 2


def _heard(numerics: Numerics, circuit: Circuit, moving: Complex) -> NDArray[np.bool_]:
    """All modes but the weakest that together stay below half the tolerance; all, where modes are
    asked for."""
    asked = {"motion", "elastic", "frame"} & set(numerics.keep)
    allowed = 0.0 if asked else numerics.tolerance / 2
    effects = np.array([circuit.effect(one) for one in moving])
    order = np.argsort(effects, kind="stable")
    heard = np.ones(len(effects), bool)
    heard[order[np.cumsum(effects[order]) < allowed]] = False
    return heard


def _worth(
    numerics: Numerics, circuit: Circuit, where: Imprint, modes: StackModes, kept: list[bool]
) -> NDArray[np.int64]:
    """The modes to solve: of the first and the higher ones, as each is `kept`, the strongest."""
    wanted = np.concatenate([kept[:1], np.repeat(kept[1], len(modes.square) - 1)])
    candidates = np.flatnonzero(wanted & _within(modes.square))
    moving = _through(circuit, where, modes)[candidates]
    strong = np.flatnonzero(_heard(numerics, circuit, moving))
    return candidates[_strongest(circuit, moving, strong)]


def _strongest(circuit: Circuit, moving: Complex, some: NDArray[np.int64]) -> NDArray[np.int64]:
    """Of `some` modes, by their place, the MOST_MODES of most effect."""
    order = np.argsort([-circuit.effect(one) for one in moving[some]], kind="stable")
    return np.sort(some[order[:MOST_MODES]])


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
