"""Walls and modes that the pressure moves.

Each wall of area S (membrane, lossy housing, hose) reacts locally: m dv/dt + r v + k ∫v dt = p. The
trapezoidal rule solves this equation, so no mass, resistance or stiffness limits the time step.

Mode n moves as a whole: m v' + r v + k ∫v dt = Σ_i W_ni p_i. It removes the volume velocity W_ni
v_n from cell i. The weights W are the same in both directions, so reciprocity and the energy
balance hold. The trapezoidal rule solves all modes together with the pressures. With w twice the
mean velocity of the step, (Z⁻¹ + G) w = W (p + p⁺) + 2 F, where Z⁻¹ = 2m/Δt + r + kΔt/2.
G = ½ W yield Wᵀ is the coupling of the modes through the cells that they share. The matrix is
positive definite for any m, r, k ≥ 0, so no light, stiff or fast mode limits the time step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve

Real = NDArray[np.floating]
Integer = NDArray[np.int64]
#: Least impedance (Pa s/m) of a wall: 1e-8 of that of air, like a vacuum.
WEAKEST = 1e-6


class Walls(NamedTuple):
    """W locally reacting walls after discretisation, any number per cell; all arrays are (W,).

    `cell` is a flat index. `admittance` z = 1/(2m/Δt + r + kΔt/2), `inertia` 2m/Δt and
    `half_spring` kΔt/2 are per area. `coupling` is yield · S · z: the decrease of the pressure per
    pressure on the wall.
    """

    cell: NDArray
    coupling: NDArray
    admittance: NDArray
    inertia: NDArray
    half_spring: NDArray


@dataclass(frozen=True)
class WallList:
    """W walls before discretisation; all arrays are (W,).

    `cell` is a flat index, `area` is in m². Per area, `mass` is in kg/m², `resistance` in Pa s/m
    and `stiffness` in N/m³.
    """

    cell: Integer
    area: Real
    mass: Real
    resistance: Real
    stiffness: Real

    @classmethod
    def uniform(cls, area: Real, mass: float, resistance: float, stiffness: float) -> WallList:
        """Return equal walls in each cell in which `area` (m², (nz, ny, nx)) is positive."""
        cell = np.flatnonzero(area)
        ones = np.ones(len(cell))
        return cls(cell, area.ravel()[cell], mass * ones, resistance * ones, stiffness * ones)

    def __add__(self, other: WallList) -> WallList:
        pairs = zip(vars(self).values(), vars(other).values(), strict=True)
        return WallList(*(np.concatenate(pair) for pair in pairs))


NO_WALLS = WallList(np.zeros(0, np.int64), *(np.zeros(0) for _ in range(4)))


def connected(walls: WallList, live: NDArray[np.bool_]) -> WallList:
    """Return the walls in `live` cells (nz, ny, nx): those that an open face connects to others."""
    is_live = live.ravel()[walls.cell]
    return WallList(*(values[is_live] for values in vars(walls).values()))


class Modes(NamedTuple):
    """N modes over K cells after discretisation.

    `cell` (K,) is a flat index, `weight` (N, K) is in m², and `half_yield` (K,) is half of the
    yield of the cells. `inverse` (N, N) is (Z⁻¹ + G)⁻¹, `gram` (N, N) is G, `inertia` (N,) is
    2m/Δt, and `half_spring` (N,) is kΔt/2.
    """

    cell: NDArray
    weight: NDArray
    half_yield: NDArray
    inverse: NDArray
    gram: NDArray
    inertia: NDArray
    half_spring: NDArray


@dataclass(frozen=True)
class ModeList:
    """N modes over K cells before discretisation.

    `cell` (K,) is a flat index, and `weight` (N, K) is in m². `mass` (kg), `resistance` (N s/m) and
    `stiffness` (N/m) are modal, (N,).
    """

    cell: Integer
    weight: Real
    mass: Real
    resistance: Real
    stiffness: Real

    def __add__(self, other: ModeList) -> ModeList:
        # Each cell occurs once, because modes are coupled through the cells that they share.
        cell, index = np.unique(np.concatenate([self.cell, other.cell]), return_inverse=True)
        count = len(self.mass)
        weight = np.zeros((count + len(other.mass), len(cell)))
        np.add.at(weight[:count].T, index[: len(self.cell)], self.weight.T)
        np.add.at(weight[count:].T, index[len(self.cell) :], other.weight.T)
        return ModeList(
            cell,
            weight,
            np.concatenate([self.mass, other.mass]),
            np.concatenate([self.resistance, other.resistance]),
            np.concatenate([self.stiffness, other.stiffness]),
        )


NO_MODES = ModeList(np.zeros(0, np.int64), np.zeros((0, 0)), *(np.zeros(0) for _ in range(3)))


def coupled(modes: ModeList, yield_: Real, dt: float, dtype: type = np.float64) -> Modes:
    """Return the coefficients of modes for the time step `dt` (s).

    `yield_` (cells,) is the change of the pressure in a cell per volume velocity, Pa per m³/s, with
    the effect of its walls. Arrays over cells have the type `dtype` of the pressure, and all others
    are float64. Raises ValueError if modes without mass, resistance and stiffness move the same
    volume.
    """
    live = yield_[modes.cell] > 0
    cell = modes.cell[live]
    weight = np.ascontiguousarray(modes.weight[:, live])
    half_yield = yield_[cell] / 2
    gram = (weight * half_yield) @ weight.T
    inertia = 2 * modes.mass / dt
    half_spring = modes.stiffness * dt / 2
    matrix = gram + np.diag(inertia + modes.resistance + half_spring)
    scale = 1 / np.sqrt(np.maximum(np.diag(matrix), np.finfo(float).tiny))
    try:
        factor = cho_factor(scale[:, None] * matrix * scale)
    except LinAlgError as error:
        raise ValueError("modes without mass, resistance and stiffness move one volume") from error
    inverse = scale[:, None] * cho_solve(factor, np.eye(len(scale))) * scale
    return Modes(
        cell.astype(np.uint64),
        weight.astype(dtype),
        half_yield.astype(dtype),
        inverse,
        gram,
        inertia,
        half_spring,
    )
