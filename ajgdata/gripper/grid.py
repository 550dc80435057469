"""Cut cells: the open part of each cubic cell, and of each face between two cells.

Arrays are (nz, ny, nx). They have two empty layers at both ends of z and no empty layer along x.
Along y, empty rows make a slab a whole number of vectors. An array of faces contains the face
between a cell and its upper neighbour along its axis. The last face of a row is closed, because the
first cell of the next row is not its neighbour.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numba import njit
from numpy.typing import NDArray

#: Samples per cell along x and along y.
FINER = 4
#: Shares of walls below this are rounding errors.
SLIGHT = 1e-3
#: Cells in the longest vector of float32, a cache line. A slab is a whole number of vectors, so a
#: vector and its neighbours along z are in one line each.
LANES = 16
Real = NDArray[np.floating]


class Columns(Protocol):
    """A domain that each vertical line crosses in one interval or not at all."""

    def at(self, x: Real, y: Real) -> tuple[Real, Real, Real, Real]:
        """Return floor, roof and surface of the grains (m) and the contact of the floor, (y, x)."""
        ...


@dataclass(frozen=True)
class Cells:
    """Cells of width `h` (m), with the centres x, y and z (m).

    `volume` is the open volume (m³), and `bed` the part of it in the grains. `area_x`, `area_y` and
    `area_z` are open areas of faces (m²). `membrane` and `housing` are areas of walls (m²), and
    `covered` is the area of the membrane on which grains lie (m²).
    """

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
    covered: Real
    housing: Real

    @property
    def shape(self) -> tuple[int, int, int]:
        """(nz, ny, nx)."""
        return len(self.z), len(self.y), len(self.x)


def cut_cells(columns: Columns, h: float, half_width: float, bottom: float, top: float) -> Cells:
    """Cut a cubic grid of spacing `h` (m) with `columns`.

    The grid covers ±half_width, and a face is at z = top. Volumes and areas are exact along z and
    sampled along x and y, with FINER samples per cell. The slope of the boundary decides about the
    open part of horizontal faces, so their areas vary smoothly.

    Raises ValueError if the domain touches the edge of the grid.
    """
    nx = 2 * int(np.ceil(half_width / h - 1e-9))
    ny = next(rows for rows in range(nx, nx + LANES, 2) if rows * nx % LANES == 0)
    nz = int(np.ceil((top - bottom) / h)) + 4
    # With an empty layer all around, which is removed at the end.
    x = _centred(nx + 2, h)
    y = _centred(ny + 2, h)
    z = top + (np.arange(nz) - nz + 2.5) * h
    base = float(z[0]) - h / 2
    fine_x = _centred(len(x) * FINER, h / FINER)
    fine_y = _centred(len(y) * FINER, h / FINER)
    floor, roof, surface, contact = columns.at(fine_x, fine_y)
    floor_rise = _rise(floor, h / FINER)
    roof_rise = _rise(roof, h / FINER)
    volume, bed, area_z, roofless_z, floor_area, touching, under_grains = _fill(
        floor, roof, surface, contact, floor_rise, roof_rise, base, h, nz
    )
    if any(np.any(np.take(volume, (0, -1), axis)) for axis in range(3)):
        raise ValueError("the domain reaches the edge of its grid: enlarge half_width or bottom")
    floor, roof, _, _ = columns.at(x + h / 2, fine_y)
    area_x, roofless_x = _sides(floor, roof, base, h, nz)
    floor, roof, _, _ = columns.at(fine_x, y + h / 2)
    area_y, roofless_y = (
        np.ascontiguousarray(side.transpose(0, 2, 1))
        for side in _sides(floor.T.copy(), roof.T.copy(), base, h, nz)
    )
    for area, axis in ((area_x, 2), (area_y, 1), (area_z, 0)):
        area[(volume == 0) | (np.roll(volume, -1, axis) == 0)] = 0.0
    # The walls of a domain without a roof are those of the floor.
    all_walls = _wall_vectors(area_x, area_y, area_z)
    floor_walls = _wall_vectors(roofless_x, roofless_y, roofless_z)
    lower = _norm(floor_walls)
    upper = _norm([w - g for w, g in zip(all_walls, floor_walls, strict=True)])
    total = np.where(volume > 0, _norm(all_walls), 0.0)
    total[total < SLIGHT**2 * h**2] = 0.0
    both = lower + upper
    share = np.divide(lower, both, out=np.zeros_like(both), where=both > 0)
    # Rounding must not give a cell walls of both kinds.
    share[share < SLIGHT] = 0.0
    share[share > 1 - SLIGHT] = 1.0
    free = 1 - np.divide(touching, floor_area, out=np.zeros_like(bed), where=floor_area > 0)
    membrane = total * share
    membrane *= free
    # A cell that only the rim of the floor cuts has no sample of the floor; it has the share of the
    # grains in its volume.
    grains = np.divide(bed, volume, out=np.zeros_like(bed), where=volume > 0)
    covered = np.divide(under_grains, floor_area, out=grains, where=floor_area > 0)
    arrays = (
        volume,
        bed,
        area_x,
        area_y,
        area_z,
        membrane,
        membrane * covered,
        total * (1 - share),
    )
    inner = (np.ascontiguousarray(array[:, 1:-1, 1:-1]) for array in arrays)
    return Cells(h, x[1:-1], y[1:-1], z, *inner)


def _centred(count: int, h: float) -> Real:
    """Return the centres (count,) of cells of width `h` (m) around 0."""
    return (np.arange(count) - count / 2 + 0.5) * h


def _rise(height: Real, spacing: float) -> Real:
    """Return the rise (m) of a boundary across each sample, never quite zero.

    It is the smaller one of both one-sided differences, so that a sample next to a cliff does not
    count as a part of the cliff.
    """
    rise = np.full(height.shape, 1e-9 * spacing)
    for axis in (0, 1):
        step = np.abs(np.diff(height, axis=axis))
        before = [(0, 0), (0, 0)]
        before[axis] = (1, 0)
        after = [(0, 0), (0, 0)]
        after[axis] = (0, 1)
        rise += np.minimum(np.pad(step, before, mode="edge"), np.pad(step, after, mode="edge"))
    return rise


@njit(cache=True)
def _fill(floor, roof, surface, contact, floor_rise, roof_rise, base, h, nz):
    """Return seven sums over the samples in each cell, (7, nz, ny, nx).

    These are the volume (m³), the volume in the grains (m³), and areas (m²): of the upper face, of
    the upper face without a roof, of the floor, of the floor with contact, and of the floor below
    the surface of the grains.
    """
    ny = floor.shape[0] // FINER
    nx = floor.shape[1] // FINER
    out = np.zeros((7, nz, ny, nx))
    volume, bed, area, roofless, floor_area, touching, under_grains = out
    tile = (h / FINER) ** 2
    for j in range(floor.shape[0]):
        for i in range(floor.shape[1]):
            low = floor[j, i]
            high = roof[j, i]
            y = j // FINER
            x = i // FINER
            # Rounding must not open a film of air above a roof that coincides with a face.
            if high - low < 1e-9 * h:
                continue
            rise = floor_rise[j, i]
            fall = roof_rise[j, i]
            slant = tile * np.sqrt(1 + (rise * FINER / h) ** 2)
            for k in range(max(0, int((low - rise - base) / h)), nz):
                bottom = base + k * h
                top = bottom + h
                inside = min(high, top) - max(low, bottom)
                if inside > 1e-9 * h:
                    volume[k, y, x] += tile * inside
                    bed[k, y, x] += tile * max(
                        0.0, min(high, top, surface[j, i]) - max(low, bottom)
                    )
                above_floor = min(max((top - low) / rise + 0.5, 0.0), 1.0)
                roofless[k, y, x] += tile * above_floor
                below_roof = min(max((high - top) / fall + 0.5, 0.0), 1.0)
                area[k, y, x] += tile * max(0.0, above_floor + below_roof - 1)
                first = max(bottom, low - rise / 2)
                last = min(top, low + rise / 2)
                part = last - first
                if part > 0:
                    floor_area[k, y, x] += slant * part / rise
                    touching[k, y, x] += slant * part / rise * contact[j, i]
                    sunk = max(0.0, min(last, surface[j, i]) - first)
                    under_grains[k, y, x] += slant * sunk / rise
    return out


@njit(cache=True)
def _sides(floor, roof, base, h, nz):
    """Return the open areas (nz, ny, nx) of vertical faces, with and without the roof.

    `floor` and `roof` (FINER ny, nx) are heights (m) along the faces, with FINER samples per face.
    """
    ny = floor.shape[0] // FINER
    nx = floor.shape[1]
    area = np.zeros((nz, ny, nx))
    roofless = np.zeros((nz, ny, nx))
    width = h / FINER
    for k in range(nz):
        bottom = base + k * h
        top = bottom + h
        for j in range(floor.shape[0]):
            for i in range(nx):
                low = max(floor[j, i], bottom)
                roofless[k, j // FINER, i] += width * max(0.0, top - low)
                area[k, j // FINER, i] += width * max(0.0, min(roof[j, i], top) - low)
    return area, roofless


def _wall_vectors(area_x: Real, area_y: Real, area_z: Real) -> list[Real]:
    """Return the vector area (x, y, z) of the walls in each cell.

    It closes the surface of the cell, so it is the difference of opposite open faces (Gauss).
    """
    return [
        area_x - np.roll(area_x, 1, 2),
        area_y - np.roll(area_y, 1, 1),
        area_z - np.roll(area_z, 1, 0),
    ]


def _norm(vector: list[Real]) -> Real:
    return np.sqrt(sum((v**2 for v in vector), start=np.zeros_like(vector[0])))
