"""Cut cells: which part of each cubic cell, and of each face between two, is open.

Arrays are (nz, ny, nx) with one empty layer all around; face arrays hold the face between a cell
and its upper neighbour along their axis.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

FINER = 4
Real = NDArray[np.floating]


class Columns(Protocol):
    """A domain that every vertical line crosses in at most one interval."""

    def at(self, x: Real, y: Real) -> tuple[Real, Real, Real, Real]:
        """Floor, roof, surface of the grains (m) and contact of the floor, each (y, x)."""
        ...


@dataclass(frozen=True)
class Cells:
    """Open volumes (m³), the grains' part of them, open face areas and wall areas (m²)."""

    h: float
    x: Real
    y: Real
    z: Real
    volume: Real
    bed: Real
    area_x: Real
    area_y: Real
    area_z: Real
    membrane: Real
    housing: Real

    @property
    def shape(self) -> tuple[int, int, int]:
        """(nz, ny, nx)."""
        return len(self.z), len(self.y), len(self.x)


def cut_cells(columns: Columns, h: float, half_width: float, bottom: float, top: float) -> Cells:
    """Cut a cubic grid of spacing `h` (m) with `columns`.

    The grid is centred on the axis, covers ±half_width, and a face lies at z = top. Volumes and
    areas are exact along z and sampled four times finer than the grid along x and y; horizontal
    faces weigh each sample by the slope of the boundary through it, so that all areas vary
    smoothly with the geometry.
    """
    nx = 2 * (int(np.ceil(half_width / h)) + 1)
    nz = int(np.ceil((top - bottom) / h)) + 2
    centre = (np.arange(nx) - nx / 2 + 0.5) * h
    z = top + (np.arange(nz) - nz + 1.5) * h
    fine = (np.arange(nx * FINER) - nx * FINER / 2 + 0.5) * h / FINER
    floor, roof, surface, _ = columns.at(fine, fine)
    tile = (h / FINER) ** 2
    lower, upper = z[:, None, None] - h / 2, z[:, None, None] + h / 2
    low, high = np.maximum(floor, lower), np.minimum(roof, upper)
    volume = _blocks(np.clip(high - low, 0, None)) * tile
    bed = _blocks(np.clip(np.minimum(high, surface) - low, 0, None)) * tile
    # Rounding must not open a film of air above a roof that coincides with a face.
    volume[volume < 1e-9 * h**3] = 0.0
    if any(np.any(np.take(volume, (0, -1), axis)) for axis in range(3)):
        raise ValueError("the domain reaches the edge of its grid: enlarge half_width or bottom")
    below, above = _slope(floor, h / FINER), _slope(roof, h / FINER)
    opening = np.clip((upper - floor) / below + 0.5, 0, 1) + np.clip(
        (roof - upper) / above + 0.5, 0, 1
    )
    area_z = _blocks(np.clip(opening - 1, 0, 1)) * tile
    area_x = _side(columns.at(centre + h / 2, fine), lower, upper, axis=1) * h / FINER
    area_y = _side(columns.at(fine, centre + h / 2), lower, upper, axis=2) * h / FINER
    for area, axis in ((area_x, 2), (area_y, 1), (area_z, 0)):
        area[(volume == 0) | (np.roll(volume, -1, axis) == 0)] = 0.0
    wall = _wall_area(area_x, area_y, area_z)
    # The membrane is what is near the floor; rim cells count by their centre's column.
    middle, _, _, touching = columns.at(centre, centre)
    is_floor = z[:, None, None] < np.maximum(middle + h, 0.0)
    free = np.where(is_floor, 1 - np.clip(touching, 0, 1), 0.0)
    wall[volume == 0] = 0.0
    return Cells(
        h, centre, centre, z, volume, bed, area_x, area_y, area_z, wall * free, wall * ~is_floor
    )


def _blocks(fine: Real) -> Real:
    """Sums over FINER x FINER samples."""
    nz, ny, nx = fine.shape
    return fine.reshape(nz, ny // FINER, FINER, nx // FINER, FINER).sum(axis=(2, 4))


def _slope(height: Real, spacing: float) -> Real:
    """How far the boundary rises across one sample, never quite zero.

    The smaller of the two one-sided differences, so that a sample beside a cliff is not taken for
    a part of it.
    """
    rise = np.full(height.shape, 1e-9 * spacing)
    for axis in (0, 1):
        step = np.abs(np.diff(height, axis=axis))
        before, after = [(0, 0), (0, 0)], [(0, 0), (0, 0)]
        before[axis], after[axis] = (1, 0), (0, 1)
        rise += np.minimum(np.pad(step, before, mode="edge"), np.pad(step, after, mode="edge"))
    return rise


def _side(at: tuple[Real, ...], lower: Real, upper: Real, axis: int) -> Real:
    """Open heights in the vertical faces of one direction, summed over the samples on `axis`."""
    floor, roof = at[:2]
    heights = np.clip(np.minimum(roof, upper) - np.maximum(floor, lower), 0, None)
    shape = list(heights.shape)
    shape[axis : axis + 1] = [shape[axis] // FINER, FINER]
    return heights.reshape(shape).sum(axis=axis + 1)


def _wall_area(area_x: Real, area_y: Real, area_z: Real) -> Real:
    """Wall inside each cell: what the open faces lack to be a closed surface (Gauss)."""
    missing = [
        area - np.roll(area, 1, axis) for area, axis in ((area_x, 2), (area_y, 1), (area_z, 0))
    ]
    return np.sqrt(sum((m**2 for m in missing), start=np.zeros_like(area_x)))
