"""Domains and ready systems that the studies march: boxes, spheres, tubes, and a lossy bowl."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.medium import Air, Packing
from ajgdata.gripper.scene import SAMPLE_RATE_HZ
from ajgdata.gripper.solver import Probe
from ajgdata.gripper.solver_plan import steps_per_sample
from ajgdata.gripper.system import System

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


def at_cell(flat: int) -> Probe:
    """Source or receiver in one cell."""
    return Probe(np.array([flat], np.uint64), np.ones(1))


def two_probes(system: System) -> tuple[Probe, Probe]:
    """One near the bottom, among grains if there are any; one near the top."""
    live = np.flatnonzero(system.mass.ravel())
    return at_cell(int(live[len(live) // 7])), at_cell(int(live[-len(live) // 5]))
