"""Parts that the pressure moves: locally reacting walls, and modes that move as a whole.

Each wall of area S (membrane, lossy housing, hose) obeys m dv/dt + r v + k ∫v dt = p, by the
trapezoidal rule, so that no mass, resistance or stiffness limits the time step.

Mode n obeys m v' + r v + k ∫v dt = Σ_i W_ni p_i, and takes the volume velocity W_ni v_n out of cell
i. The same W both ways keeps reciprocity and the energy balance. All modes are solved together with
the pressures by the trapezoidal rule: with w twice the mean velocity of the step,
(Z⁻¹ + G) w = W (p + p⁺) + 2 F, where Z⁻¹ = 2m/Δt + r + kΔt/2 and G = ½ W yield Wᵀ is what the modes
feel of one another through the cells they share. The matrix is positive definite for any
m, r, k ≥ 0, so no mode, however light, stiff or fast, limits the time step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve

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


class Modes(NamedTuple):
    """N modes over K cells: weight (N, K) in m², half_yield (K,) and, all (N,) or (N, N),
    inverse (Z⁻¹ + G)⁻¹, gram G, inertia 2m/Δt, half_spring kΔt/2."""

    cell: NDArray
    weight: NDArray
    half_yield: NDArray
    inverse: NDArray
    gram: NDArray
    inertia: NDArray
    half_spring: NDArray


@dataclass(frozen=True)
class ModeList:
    """Modes before discretisation: cells (flat index), weight (N, K) in m², modal m, r, k (SI)."""

    cell: Integer
    weight: Real
    mass: Real
    resistance: Real
    stiffness: Real

    def __add__(self, other: ModeList) -> ModeList:
        # A cell must occur once: modes feel one another through the cells they share.
        cell, place = np.unique(np.concatenate([self.cell, other.cell]), return_inverse=True)
        count = len(self.mass)
        weight = np.zeros((count + len(other.mass), len(cell)))
        np.add.at(weight[:count].T, place[: len(self.cell)], self.weight.T)
        np.add.at(weight[count:].T, place[len(self.cell) :], other.weight.T)
        pairs = [
            np.concatenate([getattr(self, name), getattr(other, name)])
            for name in ("mass", "resistance", "stiffness")
        ]
        return ModeList(cell, weight, *pairs)


NO_MODES = ModeList(np.zeros(0, np.int64), np.zeros((0, 0)), *(np.zeros(0) for _ in range(3)))


def coupled(modes: ModeList, yield_: Real, dt: float, dtype: type = np.float64) -> Modes:
    """Coefficients for time step `dt` (s); `yield_` (cells,) in Pa per m³/s is the cells', walls
    included. What is of cells is in `dtype`, as the pressure; what is of modes in float64.

    Raises ValueError if modes without mass, resistance and stiffness move the same volume.
    """
    live = yield_[modes.cell] > 0
    cell, weight = modes.cell[live], np.ascontiguousarray(modes.weight[:, live])
    half_yield = yield_[cell] / 2
    gram = (weight * half_yield) @ weight.T
    inertia, half_spring = 2 * modes.mass / dt, modes.stiffness * dt / 2
    matrix = gram + np.diag(inertia + modes.resistance + half_spring)
    scale = 1 / np.sqrt(np.maximum(np.diag(matrix), np.finfo(float).tiny))
    try:
        factor = cho_factor(scale[:, None] * matrix * scale)
    except LinAlgError as error:
        raise ValueError("modes without mass, resistance and stiffness move one volume") from error
    inverse = scale[:, None] * cho_solve(factor, np.eye(len(scale))) * scale
    weight, half_yield = weight.astype(dtype), half_yield.astype(dtype)
    return Modes(cell.astype(np.uint64), weight, half_yield, inverse, gram, inertia, half_spring)
