"""Cut cells: which part of each cubic cell, and of each face between two, is open.

Arrays are (nz, ny, nx) with two empty layers at either end of z, none along x, and along y as many
as make a slab whole vectors; face arrays hold the face between a cell and its upper neighbour along
their axis. The last face of a row is closed, so that the next row is no neighbour.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numba import njit
from numpy.typing import NDArray

FINER = 4
SLIGHT = 1e-3
#: Cells in the longest vector of float32, a cache line: a slab is whole ones, so that a vector and
#: its neighbours along z lie in one line each.
LANES = 16
Real = NDArray[np.floating]


class Columns(Protocol):
    """A domain that every vertical line crosses in at most one interval."""

    def at(self, x: Real, y: Real) -> tuple[Real, Real, Real, Real]:
        """Floor, roof, surface of the grains (m) and contact of the floor, each (y, x)."""
        ...


@dataclass(frozen=True)
class Cells:
    """Open volumes (m³), the grains' part of them, open face areas and wall areas (m²).

    `covered` is the part of the membrane on which grains lie (m²).
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
    sampled four times finer along x and y; the slope of the boundary weighs horizontal faces, so
    that areas vary smoothly. Raises ValueError if the domain touches the edge of the grid.
    """
    nx = 2 * int(np.ceil(half_width / h - 1e-9))
    ny = next(rows for rows in range(nx, nx + LANES, 2) if rows * nx % LANES == 0)
    nz = int(np.ceil((top - bottom) / h)) + 4
    x, y = (_centred(count + 2, h) for count in (nx, ny))  # with an empty layer all around
    z = top + (np.arange(nz) - nz + 2.5) * h
    base, spacing = float(z[0]) - h / 2, h / FINER
    fine_x, fine_y = (_centred(len(axis) * FINER, spacing) for axis in (x, y))
    heights = columns.at(fine_x, fine_y)
    slopes = _slope(heights[0], spacing), _slope(heights[1], spacing)
    volume, bed, area_z, above_z, floor, touching, sunk = _fill(*heights, *slopes, base, h, nz)
    if any(np.any(np.take(volume, (0, -1), axis)) for axis in range(3)):
        raise ValueError("the domain reaches the edge of its grid: enlarge half_width or bottom")
    below, roof, _, _ = columns.at(x + h / 2, fine_y)
    area_x, above_x = _sides(below, roof, base, h, nz)
    below, roof, _, _ = columns.at(fine_x, y + h / 2)
    area_y, above_y = (
        np.ascontiguousarray(side.transpose(0, 2, 1))
        for side in _sides(below.T.copy(), roof.T.copy(), base, h, nz)
    )
    for area, axis in ((area_x, 2), (area_y, 1), (area_z, 0)):
        area[(volume == 0) | (np.roll(volume, -1, axis) == 0)] = 0.0
    wall, ground = _missing((area_x, area_y, area_z)), _missing((above_x, above_y, above_z))
    lower, upper = _norm(ground), _norm([w - g for w, g in zip(wall, ground, strict=True)])
    total, both = np.where(volume > 0, _norm(wall), 0.0), lower + upper
    total[total < SLIGHT**2 * h**2] = 0.0
    share = np.divide(lower, both, out=np.zeros_like(both), where=both > 0)
    # Nor must it make walls in open cells, or of both kinds.
    share[share < SLIGHT], share[share > 1 - SLIGHT] = 0.0, 1.0
    membrane = total * share
    free = 1 - np.divide(touching, floor, out=np.zeros_like(floor), where=floor > 0)
    # A cell that only the rim of the floor cuts has no sample of it: the grains in the cell decide.
    grains = np.divide(bed, volume, out=np.zeros_like(bed), where=volume > 0)
    wet = np.divide(sunk, floor, out=grains, where=floor > 0)
    membrane *= free
    arrays = volume, bed, area_x, area_y, area_z, membrane, membrane * wet, total * (1 - share)
    inner = (np.ascontiguousarray(array[:, 1:-1, 1:-1]) for array in arrays)
    return Cells(h, x[1:-1], y[1:-1], z, *inner)


def _centred(count: int, h: float) -> Real:
    return (np.arange(count) - count / 2 + 0.5) * h


@njit(cache=True)
def _fill(floor, roof, surface, contact, below, above, base, h, nz):
    """Per cell: volume, grains, upper face, that of a domain without a roof, floor, its contact,
    and the floor below the surface of the grains."""
    ny, nx = floor.shape[0] // FINER, floor.shape[1] // FINER
    out = np.zeros((7, nz, ny, nx))
    volume, bed, area, open_, ground, touching, wet = out
    tile = (h / FINER) ** 2
    for j in range(floor.shape[0]):
        for i in range(floor.shape[1]):
            low, high, y, x = floor[j, i], roof[j, i], j // FINER, i // FINER
            # Rounding must not open a film of air above a roof that coincides with a face.
            if high - low < 1e-9 * h:
                continue
            rise, fall = below[j, i], above[j, i]
            slant = tile * np.sqrt(1 + (rise * FINER / h) ** 2)
            for k in range(max(0, int((low - rise - base) / h)), nz):
                under = base + k * h
                over = under + h
                inside = min(high, over) - max(low, under)
                if inside > 1e-9 * h:
                    volume[k, y, x] += tile * inside
                    bed[k, y, x] += tile * max(
                        0.0, min(high, over, surface[j, i]) - max(low, under)
                    )
                rising = min(max((over - low) / rise + 0.5, 0.0), 1.0)
                open_[k, y, x] += tile * rising
                falling = min(max((high - over) / fall + 0.5, 0.0), 1.0)
                area[k, y, x] += tile * max(0.0, rising + falling - 1)
                first, last = max(under, low - rise / 2), min(over, low + rise / 2)
                part = last - first
                if part > 0:
                    ground[k, y, x] += slant * part / rise
                    touching[k, y, x] += slant * part / rise * contact[j, i]
                    wet[k, y, x] += slant * max(0.0, min(last, surface[j, i]) - first) / rise
    return out


@njit(cache=True)
def _sides(floor, roof, base, h, nz):
    """Open parts of the vertical faces on lines of samples (y, finer, x), with and without roof."""
    ny, nx = floor.shape[0] // FINER, floor.shape[1]
    area, above = np.zeros((nz, ny, nx)), np.zeros((nz, ny, nx))
    width = h / FINER
    for k in range(nz):
        under = base + k * h
        over = under + h
        for j in range(floor.shape[0]):
            for i in range(nx):
                low = max(floor[j, i], under)
                above[k, j // FINER, i] += width * max(0.0, over - low)
                area[k, j // FINER, i] += width * max(0.0, min(roof[j, i], over) - low)
    return area, above


def _slope(height: Real, spacing: float) -> Real:
    """Rise of the boundary across one sample, never quite zero.

    The smaller of the two one-sided differences, so that a sample next to a cliff is not taken for
    a part of it.
    """
    rise = np.full(height.shape, 1e-9 * spacing)
    for axis in (0, 1):
        step = np.abs(np.diff(height, axis=axis))
        before, after = [(0, 0), (0, 0)], [(0, 0), (0, 0)]
        before[axis], after[axis] = (1, 0), (0, 1)
        rise += np.minimum(np.pad(step, before, mode="edge"), np.pad(step, after, mode="edge"))
    return rise


def _missing(areas: tuple[Real, Real, Real]) -> list[Real]:
    """Vector area of the walls of each cell: what its faces lack to be closed (Gauss)."""
    return [area - np.roll(area, 1, axis) for area, axis in zip(areas, (2, 1, 0), strict=True)]


def _norm(vector: list[Real]) -> Real:
    return np.sqrt(sum((v**2 for v in vector), start=np.zeros_like(vector[0])))
