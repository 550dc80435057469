"""Domains and ready systems that the studies march: boxes, spheres, tubes, and a lossy bowl."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.grid import Cells, cut_cells
from ajgdata.gripper.medium import Air, Packing, air_fluid, fit_fluid
from ajgdata.gripper.scene import SAMPLE_RATE_HZ, Scheme
from ajgdata.gripper.solver import Probe
from ajgdata.gripper.solver_plan import stencil_weight, steps_per_sample
from ajgdata.gripper.system import Packed, System, assemble
from ajgdata.gripper.walls import NO_WALLS, WallList

Real = NDArray[np.floating]
Heights = tuple[Real | float, Real | float, Real | float]
AIR = Air(22.0)
PLASTIC = Packing(6e-3, 0.40)
SILENT = Probe(np.zeros(1, np.uint64), np.zeros(1))


@dataclass(frozen=True)
class Region:
    """Columns from a function of x and y (m) that gives floor, roof and surface (m)."""

    heights: Callable[[Real, Real], Heights]

    def at(self, x: Real, y: Real) -> tuple[Real, Real, Real, Real]:
        """Floor, roof, surface and contact (none) on the grid (y, x)."""
        xx, yy = np.meshgrid(x, y)
        floor, roof, surface = (np.broadcast_to(h, xx.shape) * 1.0 for h in self.heights(xx, yy))
        return floor, np.maximum(floor, roof), surface, np.zeros_like(xx)


def box(width: float, depth: float, height: float, bed: float = 0.0, turn: float = 0.0) -> Region:
    """A box standing on z = 0, centred on the axis, turned by `turn` (rad), grains below `bed`."""

    def heights(x: Real, y: Real) -> Heights:
        u, v = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
        inside = (np.abs(u) < width / 2) & (np.abs(v) < depth / 2)
        return 0.0, np.where(inside, height, 0.0), bed

    return Region(heights)


def sphere(radius: float, x0: float = 0.0, y0: float = 0.0) -> Region:
    """A ball of air about (x0, y0, 0)."""

    def heights(x: Real, y: Real) -> Heights:
        half = np.sqrt(np.clip(radius**2 - (x - x0) ** 2 - (y - y0) ** 2, 0, None))
        return -half, half, -radius

    return Region(heights)


def bowl() -> Region:
    """Curved, off-grid, half full of grains: every kind of cut cell."""

    def heights(x: Real, y: Real) -> Heights:
        half = np.sqrt(np.clip(0.03**2 - x**2 - y**2, 0, None))
        return -half, half * 0.8 + 0.3 * x * (half > 0), -0.004 + 0.1 * y

    return Region(heights)


BOWL = (0.031, -0.031, 0.036)


def time_step(h: float, wide: float = 0.0) -> float:
    """The time step (s) of scenes on a grid of spacing `h` (m)."""
    return 1 / (SAMPLE_RATE_HZ * steps_per_sample(h, 0.99, wide=wide))


def lossy_bowl(h: float, dtype: type = np.float64, scheme: Scheme = "second") -> System:
    """Grains with varying packing, light, stiff, heavy and resistive walls."""
    cells = cut_cells(bowl(), h, *BOWL)
    ratio = 1 + 0.1 * np.sin(np.arange(np.prod(cells.shape))).reshape(cells.shape)
    walls = (
        WallList.uniform(cells.membrane, 0.3, 450.0, 1e5)
        + WallList.uniform(cells.membrane, 1e-4, 0.0, 1e9)
        + WallList.uniform(cells.housing, 0.0, 2e5, 0.0)
    )
    grains = Packed(fit_fluid(PLASTIC, AIR), PLASTIC.porosity, ratio)
    weight = stencil_weight(scheme, h)
    return assemble(cells, air_fluid(AIR), time_step(h, weight), grains, walls, dtype, wide=weight)


def closed(
    region: Region,
    h: float,
    half: float,
    bottom: float,
    top: float,
    courant: float = 0.0,
    dtype: type = np.float64,
    scheme: Scheme = "second",
) -> tuple[Cells, System]:
    """Lossless air in rigid walls, at the usual time step or at a fraction of the largest."""
    cells = cut_cells(region, h, half, bottom, top)
    weight = stencil_weight(scheme, h)
    dt = time_step(h, weight)
    if courant:
        dt = courant * h / (np.sqrt(3) * AIR.sound_speed * (1 + 4 * weight))
    return cells, assemble(cells, air_fluid(AIR), dt, walls=NO_WALLS, dtype=dtype, wide=weight)


def at_cell(flat: int) -> Probe:
    """Source or receiver in one cell."""
    return Probe(np.array([flat], np.uint64), np.ones(1))


def two_probes(system: System) -> tuple[Probe, Probe]:
    """One near the bottom, among grains if there are any; one near the top."""
    live = np.flatnonzero(system.mass.ravel())
    return at_cell(int(live[len(live) // 7])), at_cell(int(live[-len(live) // 5]))
