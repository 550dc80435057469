"""The grasped object: how it yields, moves and rings under the sound, as local walls and modes.

With the grains' frame, sound reaches the object twice: through the pores, and as stress through
the grains. Grains do not compress, and what the air loses of its pressure on its way down it passes
on to the frame by drag (Biot 1956, without the inertia of the air). A mode of shape ψ above an
imprint of area A is then driven by A (p ψ at the surface + ∫ p ψ' dz through the bed), and pushes
volume back in the same places; without the frame by A p ψ at the imprint alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.bending import Load, Plate, PlateModes, ShellModes, ring_modes, shell_modes
from ajgdata.gripper.column import Bed, Body, Stack, StackModes, bent_modes, skin, solve, stack
from ajgdata.gripper.contact import GRAIN_SOLIDS, GRAVITY, Latex, Pack, seat
from ajgdata.gripper.geometry import Cavity
from ajgdata.gripper.grid import FINER, Cells
from ajgdata.gripper.medium import Air
from ajgdata.gripper.membrane import AirFilm, Skin, film_spring, gap_m
from ajgdata.gripper.objects import (
    MM,
    Box,
    Cube,
    Cylinder,
    Material,
    Object,
    ObjectPart,
    Sphere,
    material_of,
)
from ajgdata.gripper.parts import PhysicsPart, left_out
from ajgdata.gripper.rest import Footing, lies_on_rim, rest_on, rim_of, section
from ajgdata.gripper.scene import Scene
from ajgdata.gripper.walls import NO_MODES, NO_WALLS, ModeList, WallList

Real = NDArray[np.floating]
#: Thickness over width up to which a plate bends without shear, to a few per cent (Leissa 1969).
THIN = 0.1
#: Wall over mean radius up to which a shell has the modes of a thin one, to a few per cent.
THIN_SHELL = 0.2
#: Least cosine of the slope of a shell below the membrane, which leaves it where it is steep.
LEVELLEST = 0.2
#: By which a shell's column is stiffened: far above the band, far from rounding.
STIFFER = 1e4


@dataclass(frozen=True)
class Imprint:
    """The membrane on the object, column by column of the grid: `area` (m²) seen from above,
    heights of `floor` and `surface` (m), and `lowest`, the first open cell; 1-D over the columns
    `column` (flat index y, x)."""

    column: NDArray[np.int64]
    area: Real
    floor: Real
    surface: Real
    lowest: NDArray[np.int64]

    @property
    def total(self) -> float:
        """Area in m²."""
        return float(self.area.sum())

    @property
    def depth(self) -> float:
        """Mean depth of the grains above, m."""
        if not self.total:
            return 0.0
        return float(np.sum(self.area * (self.surface - self.floor)) / self.total)


def imprint(shape: Cavity, cells: Cells) -> Imprint:
    """Return the imprint: where the membrane of `shape` lies on the object, column by column."""
    fine = [
        (np.arange(len(axis) * FINER) + 0.5) * cells.h / FINER + axis[0] - cells.h / 2
        for axis in (cells.y, cells.x)
    ]
    y, x = np.meshgrid(*fine, indexing="ij")
    held, floor, surface = (
        _mean(shape.sampled(field, x, y)) for field in (shape.held, shape.floor, shape.surface)
    )
    open_ = (cells.volume > 0) & (cells.area_z + np.roll(cells.area_z, 1, 0) > 0)
    column = np.flatnonzero((held > 1e-6) & open_.any(0))
    lowest = open_.reshape(len(cells.z), -1)[:, column].argmax(0)
    area = held.ravel()[column] * cells.h**2
    surface = np.maximum(surface, floor)
    return Imprint(column, area, floor.ravel()[column], surface.ravel()[column], lowest)


def _mean(fine: Real) -> Real:
    ny, nx = fine.shape
    return fine.reshape(ny // FINER, FINER, nx // FINER, FINER).mean(axis=(1, 3))


def body_of(scene: Scene, where: Imprint, force: float) -> tuple[Body, Footing] | None:
    """The scene's object as a body under its imprint, and what it stands on; None if it is rigid or
    not touched."""
    thing = scene.object
    material = None if thing is None else material_of(thing.material)
    if thing is None or material is None or not where.total:
        return None
    weight = GRAVITY * material.density_kg_m3 * thing.volume_mm3 * MM**3
    footing = rest_on(scene.support, thing, material, force + weight)
    height, across = thing.size_mm[2] * MM, partial(section, thing)
    return Body(material, height, across, footing.foot_m2, where.total), footing


def bed_of(scene: Scene, where: Imprint, force: float) -> Bed | None:
    """The grains over the imprint, stressed by the grasp; None without grains or object."""
    medium = scene.medium
    if scene.object is None or medium.kind == "air" or not where.total:
        return None
    pack = Pack(medium.grain_diameter_mm * MM, medium.porosity, GRAIN_SOLIDS[medium.kind])
    stress = force / where.total
    object_ = material_of(scene.object.material)
    latex = Latex(scene.gripper.membrane.mass_kg_m2 / Latex.density)
    return Bed(pack.frame(stress), seat(stress, pack, object_, latex), where.depth)


def stack_of(scene: Scene, body: Body, footing: Footing, bed: Bed | None) -> Stack:
    """The column that `body` and, if any, `bed` make on what it rests on."""
    membrane = scene.gripper.membrane.mass_kg_m2
    if _shell(scene) is not None:
        # It rings as a shell (`ringing`), and not as a rod of its section, too.
        stiff = body.material.model_copy(update={"young_pa": STIFFER * body.material.young_pa})
        body = replace(body, material=stiff)
    return stack(body, membrane, (footing.stiffness, footing.loss), bed)


def skin_walls(where: Imprint, cells: Cells, skin: tuple[float, float, float]) -> WallList:
    """The object's skin, of mass, resistance and stiffness per area, as locally reacting walls."""
    cell = where.lowest * cells.shape[1] * cells.shape[2] + where.column
    return WallList(cell, where.area, *(value * np.ones(len(cell)) for value in skin))


def mode_weights(
    where: Imprint, cells: Cells, shapes: Real, foot: Real | None = None
) -> tuple[NDArray, Real]:
    """Cells (flat, K) and weights (N, K) in m² through which modes of `shapes` meet the air; of
    objects that bend, `foot` (N, columns) is what each column of the imprint moves by."""
    nz, slab = cells.shape[0], cells.shape[1] * cells.shape[2]
    moving = shapes[:, :1] if foot is None else foot
    if shapes.shape[1] == 1:
        return where.lowest * slab + where.column, moving * where.area
    top = cells.z[:, None] + cells.h / 2
    level = (top - where.floor) / np.maximum(where.surface - where.floor, 1e-9)
    layer = np.arange(nz)[:, None]
    rise = np.linspace(0.0, 1.0, shapes.shape[1] - 1)
    at = np.stack([np.interp(level, rise, shape[1:]) for shape in shapes])
    below = np.broadcast_to(moving[:, None, :], (len(at), 1, len(where.area)))
    # Between two levels the air gains what the lower one sinks more than the upper one.
    at = np.where(layer < where.lowest, below, at)
    moved = -np.diff(at, axis=1, prepend=below)
    highest = np.argmax((level >= 1) & (layer >= where.lowest), axis=0)
    moved[:, highest, np.arange(len(where.area))] += shapes[:, -1:]
    inside = (layer >= where.lowest) & (layer <= highest)
    return (layer * slab + where.column)[inside], (moved * where.area)[:, inside]


def mode_list(
    where: Imprint, cells: Cells, modes: StackModes, chosen: NDArray[np.int64]
) -> ModeList:
    """Return the `chosen` modes (indices), with their loss as a resistance at their own
    frequency."""
    foot = None if modes.foot is None else modes.foot[chosen]
    cell, weight = mode_weights(where, cells, modes.shape[chosen], foot)
    square = modes.square[chosen]
    resistance = modes.loss[chosen] * np.sqrt(square)
    return ModeList(cell.astype(np.int64), weight, np.ones(len(chosen)), resistance, square)


def ringing(scene: Scene, where: Imprint, cells: Cells) -> tuple[ShellModes, Real] | None:
    """Modes of a thin hollow sphere, alike round the middle of its imprint, and their shapes over
    the imprint (N, columns), as the pressure from above sees them; of any other object none."""
    shell = _shell(scene)
    if shell is None:
        return None
    sphere, thickness, material = shell
    outer = sphere.diameter_mm * MM / 2
    u, v = _from_centre(scene, sphere, where, cells)
    up = np.sqrt(np.clip(1 - (u**2 + v**2) / outer**2, LEVELLEST**2, None))
    towards = np.stack([u / outer, v / outer, up])
    middle = towards @ where.area
    modes = shell_modes(outer - thickness / 2, thickness, material)
    # Of a surface that leans, more lies below each square metre seen from above.
    return modes, modes.at(middle @ towards / np.linalg.norm(middle)) / up


def _shell(scene: Scene) -> tuple[Sphere, float, Material] | None:
    """The scene's object if it is a thin hollow sphere, its wall (m) and material."""
    shape = scene.object
    if not isinstance(shape, Sphere) or shape.shell_mm is None:
        return None
    material = material_of(shape.material)
    thin = shape.shell_mm < THIN_SHELL * (shape.diameter_mm - shape.shell_mm) / 2
    return (shape, shape.shell_mm * MM, material) if material is not None and thin else None


def on_rim(
    scene: Scene, where: Imprint, cells: Cells, body: Body
) -> tuple[PlateModes, Real] | None:
    """Modes of a plate on the rim of a concave piece, bounce and tilt among them, and their shapes
    over the imprint (N, columns); None for what is no plate, or lies elsewhere."""
    shape = scene.object
    if not isinstance(shape, Box | Cube | Cylinder) or not lies_on_rim(scene.support, shape):
        return None
    if shape.shell_mm or shape.size_mm[2] > THIN * min(shape.size_mm[:2]):
        return None
    u, v = _from_centre(scene, shape, where, cells)
    riding = Load(u, v, scene.gripper.membrane.mass_kg_m2 * where.area)
    modes = ring_modes(_plate(shape, body), rim_of(scene.support), riding)
    return modes, modes.at(u, v)


def _plate(shape: Box | Cube | Cylinder, body: Body) -> Plate:
    length, width, height = (size * MM for size in shape.size_mm)
    return Plate(length, width, height, body.material, round=isinstance(shape, Cylinder))


def _from_centre(scene: Scene, shape: Object, where: Imprint, cells: Cells) -> tuple[Real, Real]:
    """Columns of the imprint from the object's centre, along its length and width, m."""
    row, column = np.divmod(where.column, len(cells.x))
    x = cells.x[column] - scene.grasp.offset_x_mm * MM
    y = cells.y[row] - scene.grasp.offset_y_mm * MM
    turn = np.deg2rad(scene.grasp.angle_deg)
    u, v = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
    # The membrane's drape reaches a little beyond the edges.
    length, width = (size * MM / 2 for size in shape.size_mm[:2])
    return np.clip(u, -length, length), np.clip(v, -width, width)


def ringing_list(
    where: Imprint, cells: Cells, modes: ShellModes, shapes: Real, chosen: NDArray[np.int64]
) -> ModeList:
    """Return the `chosen` modes of a shell (indices), of `shapes` (N, columns), driven by the
    pressure on the imprint."""
    cell = where.lowest * cells.shape[1] * cells.shape[2] + where.column
    square = modes.square[chosen]
    resistance = modes.loss[chosen] * np.sqrt(square)
    weight = shapes[chosen] * where.area
    return ModeList(cell.astype(np.int64), weight, np.ones(len(chosen)), resistance, square)


@dataclass(frozen=True)
class Grasped:
    """The object's parts, and what they are on the grid."""

    parts: tuple[PhysicsPart, ...]
    walls: WallList = NO_WALLS
    modes: ModeList = NO_MODES


#: Nothing under the membrane gives way.
RIGID = Grasped(tuple(PhysicsPart(name, False) for name in (*get_args(ObjectPart), "support")))


def grasped(scene: Scene, shape: Cavity, cells: Cells, where: Imprint) -> Grasped:
    """Return the parts of the object of `scene`, and those that are solved as walls and modes."""
    held = body_of(scene, where, shape.force_n)
    if held is None:
        return RIGID
    body, footing = held
    absent = left_out(scene)
    grains = None if "frame" in absent else bed_of(scene, where, shape.force_n)
    plate = on_rim(scene, where, cells, body)
    if plate is not None:
        stack = bent_modes(*plate, where.area, body, grains)
    else:
        stack = solve(stack_of(scene, body, footing, grains))
    # With the grains on it the object's modes are those of both.
    moves, rings = (grains is not None or part not in absent for part in ("motion", "elastic"))
    solved = np.concatenate([[moves], np.repeat(rings, len(stack.square) - 1)])
    highest = scene.numerics.modes_hz
    chosen = np.flatnonzero(solved & _slow(stack.square, highest))
    modes = mode_list(where, cells, stack, chosen) if len(chosen) else NO_MODES
    bent = ringing(scene, where, cells)
    if bent is not None and rings:
        modes += ringing_list(where, cells, *bent, np.flatnonzero(_slow(bent[0].square, highest)))
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
    parts = [PhysicsPart(name, solved) for name, solved in present.items()]
    # The support is felt through the object's motion and bending, and solved with them.
    support = PhysicsPart("support", scene.support.kind != "rigid" and (moves or rings))
    return Grasped((*parts, support), walls, modes)


def _skins(scene: Scene, body: Body) -> tuple[Skin, AirFilm | None]:
    """The object's skin with the membrane on it, and the air between the two, if there is any."""
    membrane, gap, air = scene.gripper.membrane.mass_kg_m2, gap_m(scene), scene.environment
    wall = Skin(*skin(body, membrane))
    if not gap:
        return wall, None
    return wall, AirFilm(gap, film_spring(gap, Air(air.temperature_c, air.pressure_pa)), membrane)


def _slow(square: Real, highest_hz: float) -> NDArray[np.bool_]:
    """Return which modes are solved, by their ω²: faster ones follow the sound as stiff springs."""
    return square < (2 * np.pi * highest_hz) ** 2


def where_grasped(scene: Scene, shape: Cavity, cells: Cells) -> Imprint | None:
    """The imprint of an object that is not rigid; None where nothing could give way."""
    if scene.object is None or scene.object.material == "rigid":
        return None
    where = imprint(shape, cells)
    return where if where.total else None
