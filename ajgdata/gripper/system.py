"""Cut cells + fluids + walls -> the coefficients that the kernel marches.

In a cell of capacity M = V C the pressure p and the relaxing densities q obey
M dp/dt + Σ M c_j dq_j/dt = -Σ U - Σ S v,  τ_j dq_j/dt = p - q_j, and each locally reacting wall of
area S obeys m dv/dt + r v + k ∫v dt = p. Drag in the faces is integrated exactly; poles and walls
by the trapezoidal rule, solved for the new pressure in closed form.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.grid import Cells
from ajgdata.gripper.medium import Fluid
from ajgdata.gripper.modes import NO_MODES, ModeList, Modes, coupled
from ajgdata.gripper.walls import NO_WALLS, WallList, Walls, connected

Real = NDArray[np.floating]
Integer = NDArray[np.int64]
MARGIN = 1.0005
POLES = 2
#: A wall of less impedance (Pa s/m) than this, 1e-8 of air, is a vacuum to the sound.
WEAKEST = 1e-6


class Faces(NamedTuple):
    """U <- decay U - gain (p₊ - p), in flat arrays, for the three directions."""

    decay_x: NDArray
    decay_y: NDArray
    decay_z: NDArray
    gain_x: NDArray
    gain_y: NDArray
    gain_z: NDArray


class Capacities(NamedTuple):
    """p <- keep p_old + Σ return_j q_j - yield_ ΣU; q_j <- q_j + rate_j (p + p_old - 2 q_j)."""

    yield_: NDArray
    keep: NDArray
    return1: NDArray
    return2: NDArray
    rates: NDArray


class Span(NamedTuple):
    """Active cells lo <= i < hi of each slab; the grains lie in the first `bed_slabs`."""

    lo: NDArray
    hi: NDArray
    bed_slabs: int
    row: int
    slab: int


@dataclass(frozen=True)
class System:
    """Everything that the kernel needs, and what it cost to make it stable."""

    shape: tuple[int, int, int]
    dt: float
    faces: Faces
    capacities: Capacities
    walls: Walls
    modes: Modes
    span: Span
    mass: Real
    added_volume: float
    raised_cells: float


@dataclass(frozen=True)
class Packed:
    """The grains: their fluid, its mean porosity, and the local porosity in units of the mean."""

    fluid: Fluid
    porosity: float
    ratio: Real


def assemble(
    cells: Cells,
    air: Fluid,
    dt: float,
    grains: Packed | None = None,
    walls: WallList = NO_WALLS,
    dtype: type = np.float64,
    modes: ModeList = NO_MODES,
) -> System:
    """Coefficients for time step `dt` (s); `added_volume` is the fraction added for stability."""
    share = np.divide(cells.bed, cells.volume, out=np.zeros(cells.shape), where=cells.volume > 0)
    if grains is None:
        share = np.zeros(cells.shape)
    decay, gain = zip(
        *(
            _face(area, axis, share, cells.h, dt, air, grains)
            for area, axis in ((cells.area_x, 2), (cells.area_y, 1), (cells.area_z, 0))
        ),
        strict=True,
    )
    capacity = cells.volume * (1 - share) * air.compressibility
    relaxing = np.zeros((POLES, *cells.shape))
    rates = np.zeros(POLES)
    if grains is not None:
        dense = cells.volume * share * grains.fluid.compressibility * grains.ratio
        capacity = capacity + dense
        for j, (c, tau) in enumerate(zip(grains.fluid.strengths, grains.fluid.times, strict=True)):
            relaxing[j] = dense * c
            rates[j] = (half := dt / (2 * tau)) / (1 + half)
    reach = sum(
        (g + np.roll(g, 1, axis) for g, axis in zip(gain, (2, 1, 0), strict=True)),
        start=np.zeros(cells.shape),
    )
    # Gershgorin: with M >= Δt/2 Σ gain no eigenvalue leaves the stable range, whatever the cut.
    mass = np.where(reach > 0, np.maximum(capacity, MARGIN * dt / 2 * reach), 0.0)
    live = mass > 0
    added = float((mass - capacity)[live].sum() / capacity.sum())
    raised = float(np.mean((mass > capacity)[live]))
    walls = connected(walls, live)
    capacities, wall_terms = _pressure(mass, relaxing, rates, walls, dt)
    return System(
        cells.shape,
        dt,
        Faces(*(_flat(array, dtype) for array in (*decay, *gain))),
        Capacities(*(_flat(a, dtype) for a in (*capacities, rates))),
        Walls(wall_terms[0], *(_flat(a, dtype) for a in wall_terms[1:])),
        coupled(modes, capacities[0].ravel(), dt),
        _span(live, share > 0),
        mass,
        added,
        raised,
    )


def _flat(array: Real, dtype: type) -> NDArray:
    return np.ascontiguousarray(array, dtype=dtype).ravel()


def _face(
    area: Real, axis: int, share: Real, h: float, dt: float, air: Fluid, grains: Packed | None
) -> tuple[Real, Real]:
    """Decay and gain of the faces along one axis; the two half cells act in series."""
    wet = (share + np.roll(share, -1, axis)) / 2
    density, drag = np.full(share.shape, air.density), np.zeros(share.shape)
    if grains is not None:
        ratio = (grains.ratio + np.roll(grains.ratio, -1, axis)) / 2
        local, mean = ratio * grains.porosity, grains.porosity
        tortuous = grains.fluid.density * ratio**-1.5
        resisting = ((1 - local) / (1 - mean)) ** 2 / ratio**3
        density = density + wet * (tortuous - air.density)
        drag = wet * grains.fluid.drag * resisting
    exponent = drag * dt / density
    # (1 - e^-s)/s by expm1, exact as the drag vanishes.
    slow = np.where(exponent > 0, -np.expm1(-exponent) / np.where(exponent > 0, exponent, 1), 1.0)
    return np.exp(-exponent), area / h * dt / density * slow


def _pressure(
    mass: Real, relaxing: Real, rates: Real, walls: WallList, dt: float
) -> tuple[tuple[Real, ...], tuple[NDArray, ...]]:
    """Coefficients of the pressure update with poles and walls eliminated."""
    safe = np.where(mass > 0, mass, 1.0)
    impedance = 2 * walls.mass / dt + walls.resistance + walls.stiffness * dt / 2
    z = 1 / np.maximum(impedance, WEAKEST)
    conductance = np.bincount(walls.cell, walls.area * z, minlength=mass.size)
    wall = dt * conductance.reshape(mass.shape) / (2 * safe)
    poles = [rate * strength / safe for rate, strength in zip(rates, relaxing, strict=True)]
    denominator = 1 + sum(poles) + wall
    yield_ = np.where(mass > 0, dt / (safe * denominator), 0.0)
    keep = (1 + wall - sum(poles)) / denominator
    returns = [2 * pole / denominator for pole in poles]
    coupling = yield_.ravel()[walls.cell] * walls.area * z
    terms = (
        walls.cell.astype(np.uint64),
        coupling,
        z,
        2 * walls.mass / dt,
        walls.stiffness * dt / 2,
    )
    return (yield_, keep, *returns), terms


def _span(live: NDArray[np.bool_], grains: NDArray[np.bool_]) -> Span:
    """First and last active cell of each slab, and how many slabs hold grains."""
    nz, ny, nx = live.shape
    flat = live.reshape(nz, -1)
    first = np.where(flat.any(axis=1), flat.argmax(axis=1), 0)
    last = np.where(flat.any(axis=1), flat.shape[1] - flat[:, ::-1].argmax(axis=1), 0)
    base = np.arange(nz) * ny * nx
    wet = np.flatnonzero((live & grains).any(axis=(1, 2)))
    # A face above the topmost grains still feels half of their drag, hence + 1 below, not above:
    # it belongs to the slab of the grains themselves.
    slabs = int(wet[-1]) + 1 if len(wet) else 0
    return Span(
        (base + first).astype(np.uint64), (base + last).astype(np.uint64), slabs, nx, ny * nx
    )
