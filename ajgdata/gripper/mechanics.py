"""How the object yields, moves and rings under the sound: local walls and modes of the stack.

With the grains' frame, sound reaches the object twice: through the pores, and as stress through
the grains. Grains do not compress, and what the air loses of its pressure on its way down it passes
on to the frame by drag (Biot 1956, without the inertia of the air). A mode of shape ψ above an
imprint of area A is then driven by A (p ψ at the surface + ∫ p ψ' dz through the bed), and pushes
volume back in the same places; without the frame by A p ψ at the imprint alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from ajgdata.gripper.column import Body, Frame, Stack, StackModes, pad_stiffness, stack
from ajgdata.gripper.geometry import RASTER_M, Cavity
from ajgdata.gripper.grid import FINER, Cells
from ajgdata.gripper.materials import MATERIALS, Material, Support, material_of
from ajgdata.gripper.modes import ModeList
from ajgdata.gripper.scene import Scene
from ajgdata.gripper.sections import foot_area, section
from ajgdata.gripper.walls import WallList

MM = 1e-3
Real = NDArray[np.floating]
GRAVITY = 9.81


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
    """Where the membrane of `shape` lies on the object, on the columns of `cells`."""
    fine = (np.arange(len(cells.x) * FINER) + 0.5) * cells.h / FINER
    fine += cells.x[0] - cells.h / 2
    at = np.meshgrid(*2 * [(fine - shape.axis[0]) / RASTER_M], indexing="ij")
    held, floor, surface = (
        _mean(map_coordinates(field, at, order=1, mode="nearest"))
        for field in (shape.held, shape.floor, shape.surface)
    )
    open_ = (cells.volume > 0) & (cells.area_z + np.roll(cells.area_z, 1, 0) > 0)
    column = np.flatnonzero((held > 1e-6) & open_.any(0))
    lowest = open_.reshape(len(cells.z), -1)[:, column].argmax(0)
    area = held.ravel()[column] * cells.h**2
    return Imprint(column, area, floor.ravel()[column], surface.ravel()[column], lowest)


def _mean(fine: Real) -> Real:
    ny, nx = fine.shape
    return fine.reshape(ny // FINER, FINER, nx // FINER, FINER).mean(axis=(1, 3))


def body_of(scene: Scene, material: Material, area: float, force: float) -> Body:
    """The scene's object as a body of `material` under an imprint of `area` (m²)."""
    assert scene.object is not None
    thing = scene.object
    load = force + GRAVITY * material.density_kg_m3 * thing.volume_mm3 * MM**3
    yielding = (1 - material.poisson**2) / material.young_pa
    if scene.support.kind == "rubber":
        rubber = MATERIALS["rubber"]
        yielding += (1 - rubber.poisson**2) / rubber.young_pa
    return Body(
        material,
        thing.size_mm[2] * MM,
        lambda z: section(thing, z),
        foot_area(thing, load, 1 / yielding),
        area,
    )


def support_of(support: Support, foot_m2: float) -> tuple[float, float]:
    """Stiffness (N/m) and loss factor under a foot."""
    if support.kind == "rigid":
        return np.inf, 0.0
    rubber = MATERIALS["rubber"]
    return pad_stiffness(rubber, support.thickness_mm * MM, foot_m2), rubber.loss


def stack_of(scene: Scene, where: Imprint, force: float, frame: Frame | None) -> Stack | None:
    """Column under the imprint, with or without the grains; None if the object is rigid."""
    material = None if scene.object is None else material_of(scene.object.material)
    if material is None or not where.total:
        return None
    body = body_of(scene, material, where.total, force)
    return stack(
        body,
        scene.gripper.membrane.mass_kg_m2,
        support_of(scene.support, body.foot_m2),
        frame,
        where.depth,
    )


def local_wall(where: Imprint, cells: Cells, modes: StackModes, taken: int) -> WallList:
    """The imprint yields locally with the flexibility that the first `taken` modes leave, and
    rings with the first mode that is left out."""
    flexibility = modes.residual[taken]
    n = min(taken, len(modes.square) - 1)
    stiffness = 1 / (max(flexibility, 1e-18) * where.total)
    mass = stiffness / modes.square[n]
    count = np.ones(len(where.area))
    cell = where.lowest * cells.shape[1] * cells.shape[2] + where.column
    resistance = modes.loss[n] * np.sqrt(stiffness * mass)
    return WallList(cell, where.area, mass * count, resistance * count, stiffness * count)


def mode_weights(where: Imprint, cells: Cells, rise: Real, shapes: Real) -> tuple[NDArray, Real]:
    """Cells (flat, K) and weights (N, K) in m² through which modes of `shapes` (N, nodes at the
    fractions `rise` of the grains' depth) meet the air."""
    nz, slab = cells.shape[0], cells.shape[1] * cells.shape[2]
    if len(rise) == 1:
        return where.lowest * slab + where.column, shapes[:, :1] * where.area
    top = cells.z[:, None] + cells.h / 2
    depth = np.maximum(where.surface - where.floor, 1e-9)
    upper = np.clip((top - where.floor) / depth, 0, 1)
    layer = np.arange(nz)[:, None]
    upper = np.where(layer < where.lowest, 0.0, upper)
    at = np.stack([np.interp(upper, rise, shape) for shape in shapes])
    foot = np.broadcast_to(shapes[:, None, :1], (len(shapes), 1, len(where.area)))
    moved = -np.diff(at, axis=1, prepend=foot)
    highest = np.argmax(upper >= 1, axis=0)
    moved[:, highest, np.arange(len(where.area))] += shapes[:, -1:]
    inside = (layer >= where.lowest) & (layer <= highest)
    cell = (layer * slab + where.column)[inside]
    return cell, (moved * where.area)[:, inside]


def mode_list(
    where: Imprint, cells: Cells, modes: StackModes, chosen: NDArray[np.int64]
) -> ModeList:
    """The `chosen` modes with their loss as a resistance at their own frequency."""
    cell, weight = mode_weights(where, cells, modes.rise, modes.shape[chosen])
    square = modes.square[chosen]
    return ModeList(
        cell.astype(np.int64),
        weight,
        np.ones(len(chosen)),
        modes.loss[chosen] * np.sqrt(square),
        square,
    )
