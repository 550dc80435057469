"""Locally reacting walls: membrane, lossy housing, hose.

Each wall of area S obeys m dv/dt + r v + k ∫v dt = p, by the trapezoidal rule, so that no mass,
resistance or stiffness limits the time step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.floating]
Integer = NDArray[np.int64]
#: A wall of less impedance (Pa s/m) than this, 1e-8 of air, is a vacuum to the sound.
WEAKEST = 1e-6


class Walls(NamedTuple):
    """Locally reacting walls, any number a cell: admittance z = 1/(2m/Δt + r + kΔt/2),
    inertia 2m/Δt and half_spring kΔt/2 per area; `coupling` is what z S takes from the pressure."""

    cell: NDArray
    coupling: NDArray
    admittance: NDArray
    inertia: NDArray
    half_spring: NDArray


@dataclass(frozen=True)
class WallList:
    """Walls before discretisation: cell (flat index), area m², and per area m, r, k (SI)."""

    cell: Integer
    area: Real
    mass: Real
    resistance: Real
    stiffness: Real

    @classmethod
    def uniform(cls, area: Real, mass: float, resistance: float, stiffness: float) -> WallList:
        """Walls of one kind in every cell where `area` (nz, ny, nx) is positive."""
        cell = np.flatnonzero(area)
        ones = np.ones(len(cell))
        return cls(cell, area.ravel()[cell], mass * ones, resistance * ones, stiffness * ones)

    def __add__(self, other: WallList) -> WallList:
        pairs = zip(vars(self).values(), vars(other).values(), strict=True)
        return WallList(*(np.concatenate(pair) for pair in pairs))


NO_WALLS = WallList(np.zeros(0, np.int64), *(np.zeros(0) for _ in range(4)))


def connected(walls: WallList, live: NDArray[np.bool_]) -> WallList:
    """Drop the walls of cells that no open face connects to anything; `live` (nz, ny, nx)."""
    keep = live.ravel()[walls.cell]
    return WallList(*(values[keep] for values in vars(walls).values()))
