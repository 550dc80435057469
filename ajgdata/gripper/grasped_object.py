"""The grasped object: how it yields, moves and rings under the sound, as local walls and modes.

With the frame of the grains, sound reaches the object in two ways: through the pores, and as stress
in the grains. Grains do not compress. On its way down, the air passes the pressure that it loses to
the frame by drag (Biot 1956, without the inertia of the air). A mode of shape ψ above an imprint of
area A is then driven by A (p ψ at the surface + ∫ p ψ' dz through the bed), and displaces volume at
the same places. Without the frame, it is driven by A p ψ at the imprint.
"""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.air_film import AirFilm, film_spring, gap_m
from ajgdata.gripper.bending import Load, Plate, PlateModes, ShellModes, ring_modes, shell_modes
from ajgdata.gripper.column import Bed, Body, Stack, StackModes, bent_modes, skin, solve, stack
from ajgdata.gripper.contact import GRAIN_SOLIDS, GRAVITY, Latex, Pack, seat
from ajgdata.gripper.geometry import Cavity
from ajgdata.gripper.grid import Cells
from ajgdata.gripper.imprint import Imprint, find_imprint
from ajgdata.gripper.medium import Air
from ajgdata.gripper.objects import (
    MM,
    Box,
    Cube,
    Cylinder,
    Material,
    Object,
    ObjectPart,
    Sphere,
    Support,
    material_of,
)
from ajgdata.gripper.parts import PhysicsPart, omitted_parts
from ajgdata.gripper.rest import Footing, lies_on_rim, rest_on, rim_of, section
from ajgdata.gripper.scene import Scene
from ajgdata.gripper.walls import NO_MODES, NO_WALLS, ModeList, WallList

Real = NDArray[np.floating]
#: Largest ratio of thickness to width of a plate that bends without shear, to a few per cent
#: (Leissa 1969).
THIN = 0.1
#: Largest ratio of wall to mean radius of a shell with the modes of a thin one, to a few per cent.
THIN_SHELL = 0.2
#: Least cosine of the slope of a shell under the membrane, which does not follow steep parts.
LEAST_COSINE = 0.2
#: Factor on the stiffness of a shell's column: far above the band, and far from rounding errors.
STIFFER = 1e4


@dataclass(frozen=True)
class ObjectPhysics:
    """The parts of the object's physics; the walls and modes of the solved parts."""

    parts: tuple[PhysicsPart, ...]
    walls: WallList = NO_WALLS
    modes: ModeList = NO_MODES


#: There is no object, or a rigid one.
RIGID = ObjectPhysics(
    tuple(PhysicsPart(name, False) for name in (*get_args(ObjectPart), "support"))
)


def object_physics(scene: Scene, cavity: Cavity, cells: Cells) -> ObjectPhysics:
    """Return the parts of the object of `scene`, and the solved walls and modes."""
    shape = scene.object
    material = None if shape is None else material_of(shape.material)
    if shape is None or material is None:
        return RIGID
    imprint = find_imprint(cavity, cells)
    if not imprint.total:
        return RIGID
    body, footing = object_body(shape, material, scene.support, imprint, cavity.force_n)
    absent = omitted_parts(scene)
    bed = None if "frame" in absent else _bed(scene, material, imprint, cavity.force_n)
    # If the grains are on the object, the modes are common to both, and all are solved.
    is_moving = bed is not None or "motion" not in absent
    is_elastic = bed is not None or "elastic" not in absent
    modes = NO_MODES
    if is_moving or is_elastic:
        stack_modes = _stack_modes(scene, shape, body, footing, bed, imprint, cells)
        modes = _solved_modes(scene, stack_modes, is_moving, is_elastic, imprint, cells)
    if is_elastic:
        modes = _with_shell_modes(modes, scene, shape, material, imprint, cells)
    film = _air_film(scene)
    walls = _skin_walls(scene, body, film, absent, imprint, cells)
    present: dict[ObjectPart, bool] = {
        "motion": is_moving,
        "elastic": is_elastic,
        "compliance": "compliance" not in absent,
        "film": film is not None and "film" not in absent,
        "frame": bed is not None,
    }
    parts = [PhysicsPart(name, is_solved) for name, is_solved in present.items()]
    # The support acts through the motion and the bending of the object, and is solved with them.
    support = PhysicsPart("support", scene.support.kind != "rigid" and (is_moving or is_elastic))
    return ObjectPhysics((*parts, support), walls, modes)


def object_body(
    shape: Object, material: Material, support: Support, imprint: Imprint, force: float
) -> tuple[Body, Footing]:
    """Return an object as a body under its imprint, which `force` (N) presses, and its footing."""
    weight = GRAVITY * material.density_kg_m3 * shape.volume_mm3 * MM**3
    footing = rest_on(support, shape, material, force + weight)
    height = shape.size_mm[2] * MM
    body = Body(material, height, partial(section, shape), footing.foot_m2, imprint.total)
    return body, footing


def _bed(scene: Scene, material: Material, imprint: Imprint, force: float) -> Bed | None:
    """Return the grains over the imprint, which `force` (N) presses; None without grains.

    `material` is that of the object.
    """
    medium = scene.medium
    if medium.kind == "air":
        return None
    pack = Pack(medium.grain_diameter_mm * MM, medium.porosity, GRAIN_SOLIDS[medium.kind])
    stress = force / imprint.total
    latex = Latex(scene.gripper.membrane.mass_kg_m2 / Latex.density)
    return Bed(pack.frame(stress), seat(stress, pack, material, latex), imprint.depth)


def _stack_modes(
    scene: Scene,
    shape: Object,
    body: Body,
    footing: Footing,
    bed: Bed | None,
    imprint: Imprint,
    cells: Cells,
) -> StackModes:
    """Return the modes of the object and of the grains on it: of a plate on a rim, or a column."""
    plate = rim_modes(scene, body.material, imprint, cells)
    if plate is not None:
        modes, shapes = plate
        return bent_modes(modes, shapes, imprint.area, body, bed)
    return solve(object_stack(scene, shape, body, footing, bed))


def rim_modes(
    scene: Scene, material: Material, imprint: Imprint, cells: Cells
) -> tuple[PlateModes, Real] | None:
    """Return the modes of a plate on the rim of a concave piece, with bounce and tilt, and their
    shapes (N, columns) in the columns of the imprint.

    None if the object is not a plate, or does not lie on a rim.
    """
    shape = scene.object
    if not isinstance(shape, Box | Cube | Cylinder) or not lies_on_rim(scene.support, shape):
        return None
    if shape.shell_mm or shape.size_mm[2] > THIN * min(shape.size_mm[:2]):
        return None
    length, width, height = (size * MM for size in shape.size_mm)
    plate = Plate(length, width, height, material, round=isinstance(shape, Cylinder))
    u, v = _from_centre(scene, shape, imprint, cells)
    load = Load(u, v, scene.gripper.membrane.mass_kg_m2 * imprint.area)
    modes = ring_modes(plate, rim_of(scene.support), load)
    return modes, modes.at(u, v)


def _from_centre(scene: Scene, shape: Object, imprint: Imprint, cells: Cells) -> tuple[Real, Real]:
    """Return the positions (m, (columns,)) of the columns of the imprint along the object's length
    and width, from its centre."""
    row, column = np.divmod(imprint.column, len(cells.x))
    x = cells.x[column] - scene.grasp.offset_x_mm * MM
    y = cells.y[row] - scene.grasp.offset_y_mm * MM
    angle = np.deg2rad(scene.grasp.angle_deg)
    u = x * np.cos(angle) + y * np.sin(angle)
    v = y * np.cos(angle) - x * np.sin(angle)
    # The drape of the membrane reaches slightly beyond the edges.
    length, width = (size * MM / 2 for size in shape.size_mm[:2])
    return np.clip(u, -length, length), np.clip(v, -width, width)


def object_stack(
    scene: Scene, shape: Object, body: Body, footing: Footing, bed: Bed | None
) -> Stack:
    """Return the column of an object and, if there is a `bed`, of the grains on it."""
    if _thin_shell(shape) is not None:
        # The wall vibrates as a shell (`_shell_modes`), and not also as a rod of its section.
        stiff = body.material.model_copy(update={"young_pa": STIFFER * body.material.young_pa})
        body = replace(body, material=stiff)
    membrane_kg_m2 = scene.gripper.membrane.mass_kg_m2
    return stack(body, membrane_kg_m2, (footing.stiffness, footing.loss), bed)


def _solved_modes(
    scene: Scene,
    modes: StackModes,
    is_moving: bool,
    is_elastic: bool,
    imprint: Imprint,
    cells: Cells,
) -> ModeList:
    """Return the modes that are solved: the first one is the motion, all others are elastic."""
    is_solved = np.concatenate([[is_moving], np.repeat(is_elastic, len(modes.omega_squared) - 1)])
    chosen = np.flatnonzero(is_solved & _slow(modes.omega_squared, scene.numerics.modes_hz))
    if not len(chosen):
        return NO_MODES
    column_shapes = None if modes.column_shapes is None else modes.column_shapes[chosen]
    cell, weight = mode_weights(imprint, cells, modes.shapes[chosen], column_shapes)
    return _unit_modes(cell, weight, modes.omega_squared[chosen], modes.loss[chosen])


def _slow(omega_squared: Real, highest_hz: float) -> NDArray[np.bool_]:
    """Return which modes are solved: faster ones follow the sound as stiff springs."""
    return omega_squared < (2 * np.pi * highest_hz) ** 2


def mode_weights(
    imprint: Imprint, cells: Cells, shapes: Real, column_shapes: Real | None = None
) -> tuple[NDArray[np.int64], Real]:
    """Return the cells (flat index, (K,)) in which modes displace air, and the weights (N, K), m².

    `shapes` and `column_shapes` are those of `StackModes`.
    """
    at_imprint = shapes[:, :1] if column_shapes is None else column_shapes
    if shapes.shape[1] == 1:
        return imprint.lowest_cells(cells), at_imprint * imprint.area
    top = cells.z[:, None] + cells.h / 2
    # 0 at the lower end of the grains, 1 at their surface.
    level = (top - imprint.floor) / np.maximum(imprint.surface - imprint.floor, 1e-9)
    layer = np.arange(len(cells.z))[:, None]
    node_level = np.linspace(0.0, 1.0, shapes.shape[1] - 1)
    displacement = np.stack([np.interp(level, node_level, shape[1:]) for shape in shapes])
    below = np.broadcast_to(at_imprint[:, None, :], (len(shapes), 1, len(imprint.area)))
    displacement = np.where(layer < imprint.lowest, below, displacement)
    # The air of a cell gains the volume by which the lower side sinks more than the upper side.
    gained = -np.diff(displacement, axis=1, prepend=below)
    highest = np.argmax((level >= 1) & (layer >= imprint.lowest), axis=0)
    gained[:, highest, np.arange(len(imprint.area))] += shapes[:, -1:]
    inside = (layer >= imprint.lowest) & (layer <= highest)
    slab = cells.shape[1] * cells.shape[2]
    return (layer * slab + imprint.column)[inside], (gained * imprint.area)[:, inside]


def _unit_modes(cell: NDArray[np.int64], weight: Real, omega_squared: Real, loss: Real) -> ModeList:
    """Return modes of unit mass, with their loss as a resistance at their own frequency."""
    resistance = loss * np.sqrt(omega_squared)
    mass = np.ones(len(omega_squared))
    return ModeList(cell.astype(np.int64), weight, mass, resistance, omega_squared)


class _Shell(NamedTuple):
    """A thin hollow sphere: outer radius and thickness of its wall, m."""

    radius: float
    thickness: float


def _thin_shell(shape: Object) -> _Shell | None:
    """Return the shell of a thin hollow sphere; None for any other object."""
    if not isinstance(shape, Sphere) or shape.shell_mm is None:
        return None
    if shape.shell_mm >= THIN_SHELL * (shape.diameter_mm - shape.shell_mm) / 2:
        return None
    return _Shell(shape.diameter_mm * MM / 2, shape.shell_mm * MM)


def _with_shell_modes(
    modes: ModeList,
    scene: Scene,
    shape: Object,
    material: Material,
    imprint: Imprint,
    cells: Cells,
) -> ModeList:
    """Return `modes` with those of the wall, if the object is a thin hollow sphere."""
    shell = _thin_shell(shape)
    if shell is None:
        return modes
    u, v = _from_centre(scene, shape, imprint, cells)
    of_wall, shapes = _shell_modes(shell, material, u, v, imprint.area)
    chosen = np.flatnonzero(_slow(of_wall.omega_squared, scene.numerics.modes_hz))
    return modes + _unit_modes(
        imprint.lowest_cells(cells),
        shapes[chosen] * imprint.area,
        of_wall.omega_squared[chosen],
        of_wall.loss[chosen],
    )


def _shell_modes(
    shell: _Shell, material: Material, u: Real, v: Real, area: Real
) -> tuple[ShellModes, Real]:
    """Return the modes of a shell that are symmetric about the middle of its imprint, and their
    shapes (N, columns).

    The imprint has the positions u, v (m) from the centre and the areas (m²), all (columns,). The
    shapes are those for a pressure on the area seen from above.
    """
    cosine = np.sqrt(np.clip(1 - (u**2 + v**2) / shell.radius**2, LEAST_COSINE**2, None))
    normal = np.stack([u / shell.radius, v / shell.radius, cosine])
    middle = normal @ area
    modes = shell_modes(shell.radius - shell.thickness / 2, shell.thickness, material)
    # Below each square metre seen from above, an inclined surface has a larger area.
    return modes, modes.at(middle @ normal / np.linalg.norm(middle)) / cosine


def _air_film(scene: Scene) -> AirFilm | None:
    """Return the air between the membrane and the object; None without a gap."""
    gap = gap_m(scene)
    if not gap:
        return None
    air = Air(scene.environment.temperature_c, scene.environment.pressure_pa)
    return AirFilm(gap, film_spring(gap, air), scene.gripper.membrane.mass_kg_m2)


def _skin_walls(
    scene: Scene,
    body: Body,
    film: AirFilm | None,
    absent: Set[ObjectPart],
    imprint: Imprint,
    cells: Cells,
) -> WallList:
    """Return the object's skin, with the membrane and the film of air on it, as local walls."""
    yielding = None
    if "compliance" not in absent:
        yielding = skin(body, scene.gripper.membrane.mass_kg_m2)
    if film is not None and "film" not in absent:
        yielding = film.over(yielding)
    if yielding is None:
        return NO_WALLS
    cell = imprint.lowest_cells(cells)
    return WallList(cell, imprint.area, *(value * np.ones(len(cell)) for value in yielding))
