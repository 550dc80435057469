"""Coefficients of the kernel from cut cells, fluids, walls and modes.

A cell of capacity M = V C has the pressure p and the relaxing densities q_j:
M dp/dt + Σ M c_j dq_j/dt = -Σ U - Σ S v and τ_j dq_j/dt = p - q_j. Each locally reacting wall of
area S obeys m dv/dt + r v + k ∫v dt = p. The drag in the faces is integrated exactly. The
trapezoidal rule integrates poles and walls, with a closed form of the new pressure.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ajgdata.gripper.grid import LANES, Cells
from ajgdata.gripper.medium import Fluid
from ajgdata.gripper.walls import (
    NO_MODES,
    NO_WALLS,
    WEAKEST,
    ModeList,
    Modes,
    WallList,
    Walls,
    connected,
    coupled,
)

Real = NDArray[np.floating]
#: Safety factor of the least capacity of a cell, for rounding errors.
MARGIN = 1.0005
#: Largest number of relaxation poles.
POLES = 2
#: Largest number of passes of `_share_out`; a dozen have sufficed in every scene so far.
ROUNDS = 40
#: Bytes of a cache line. Arrays begin with one, because loads across two lines take twice the time.
LINE = 64


class Faces(NamedTuple):
    """U <- decay U - gain D p, in flat arrays, for the faces of the three directions.

    U is (1 + 3w) times the volume velocity, and so the gain has the factor (1 + 3w)².
    """

    decay_x: NDArray
    decay_y: NDArray
    decay_z: NDArray
    gain_x: NDArray
    gain_y: NDArray
    gain_z: NDArray


class Reach(NamedTuple):
    """w/(1 + 3w) of the faces, in flat arrays; w is the weight of the four-point difference."""

    x: NDArray
    y: NDArray
    z: NDArray


class Capacities(NamedTuple):
    """p <- keep p_old + Σ return_j q_j - yield_ Σ U; q_j <- q_j + rate_j (p + p_old - 2 q_j).

    The arrays are flat. `rates` (4,) are both rates, and 1 - 2 rate of both.
    """

    yield_: NDArray
    keep: NDArray
    return1: NDArray
    return2: NDArray
    rates: NDArray


class Span(NamedTuple):
    """Flat indices of the cells that the kernel updates.

    In each slab, these are lo <= i < hi, both (slabs,). The grains are in the first `bed_slabs`. A
    row has `row` cells, and a slab has `slab` cells.
    """

    lo: NDArray
    hi: NDArray
    bed_slabs: int
    row: int
    slab: int


@dataclass(frozen=True)
class System:
    """All that the kernel needs for cells of `shape` (nz, ny, nx) and a time step `dt` (s).

    `mass` (nz, ny, nx) is the capacity of the cells (m³/Pa). `added_volume` is the share of the
    capacity that was added for stability, and `raised_cells` the share of cells that received
    capacity from their neighbours for stability.
    """

    shape: tuple[int, int, int]
    dt: float
    faces: Faces
    reach: Reach
    capacities: Capacities
    walls: Walls
    modes: Modes
    span: Span
    mass: Real
    added_volume: float
    raised_cells: float


@dataclass(frozen=True)
class Packed:
    """The grains: their fluid, its mean porosity, and the local porosity in units of the mean,
    `ratio` (nz, ny, nx)."""

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
    wide: float = 0.0,
) -> System:
    """Return the coefficients for the time step `dt` (s).

    The kernel computes in the type `dtype`. `wide` is the weight of the four-point differences.
    """
    share = _grain_share(cells, grains)
    decay: list[Real] = []
    gain: list[Real] = []
    weight: list[Real] = []
    for area, axis in ((cells.area_x, 2), (cells.area_y, 1), (cells.area_z, 0)):
        face_decay, face_gain = _face(area, axis, share, cells.h, dt, air, grains)
        decay.append(face_decay)
        gain.append(face_gain)
        weight.append(_weight(area, axis, share, wide))
    capacity, relaxing, rates = _capacity(cells, air, dt, share, grains)
    least = MARGIN * dt / 4 * _row_sums(_fastest_gain(gain, decay), weight)
    live = least > 0
    mass = np.where(live, np.maximum(_share_out(capacity, least), least), 0.0)
    added = float((mass - capacity)[live].sum() / capacity.sum())
    raised = float(np.mean((least > capacity)[live]))
    walls = connected(walls, live)
    yield_, keep, returns = _pressure(mass, relaxing, rates, walls, dt)
    scaled_gain = [g * (1 + 3 * w) ** 2 for g, w in zip(gain, weight, strict=True)]
    reach = [w / (1 + 3 * w) for w in weight]
    capacities = (yield_, keep, *returns, np.append(rates, 1 - 2 * rates))
    return System(
        cells.shape,
        dt,
        Faces(*(_flat(array, dtype) for array in (*decay, *scaled_gain))),
        Reach(*(_flat(array, dtype) for array in reach)),
        Capacities(*(_flat(array, dtype) for array in capacities)),
        _moving_walls(walls, yield_.ravel(), dt, dtype),
        coupled(modes, yield_.ravel(), dt, dtype),
        _span(live, share > 0),
        mass,
        added,
        raised,
    )


def _grain_share(cells: Cells, grains: Packed | None) -> Real:
    """Return the share of each open cell that is filled with grains."""
    if grains is None:
        return np.zeros(cells.shape)
    return np.divide(cells.bed, cells.volume, out=np.zeros(cells.shape), where=cells.volume > 0)


def _face(
    area: Real, axis: int, share: Real, h: float, dt: float, air: Fluid, grains: Packed | None
) -> tuple[Real, Real]:
    """Return decay and gain of the faces of `area` (m²) along one axis.

    The grains end in a nearly horizontal surface. Along z, the two media act in series, each on its
    side of the surface in the half cells next to a face. Along x and y, they act in parallel.
    """
    density = np.full(share.shape, air.density)
    drag = np.zeros(share.shape)
    if grains is not None:
        ratio = (grains.ratio + np.roll(grains.ratio, -1, axis)) / 2
        local = ratio * grains.porosity
        mean = grains.porosity
        tortuous = grains.fluid.density * ratio**-1.5
        resisting = grains.fluid.drag * ((1 - local) / (1 - mean)) ** 2 / ratio**3
        if axis == 0:
            lower = np.minimum(2 * share, 1)
            upper = np.maximum(2 * share - 1, 0)
            wet = (upper + np.roll(lower, -1, axis)) / 2
            density = density + wet * (tortuous - air.density)
            drag = wet * resisting
        else:
            wet = (share + np.roll(share, -1, axis)) / 2
            density = 1 / ((1 - wet) / air.density + wet / tortuous)
            drag = density**2 * wet * resisting / tortuous**2
    exponent = drag * dt / density
    # (1 - e^-s)/s by expm1 is exact for small drags.
    slow = np.where(exponent > 0, -np.expm1(-exponent) / np.where(exponent > 0, exponent, 1), 1.0)
    return np.exp(-exponent), area / h * dt / density * slow


def _weight(area: Real, axis: int, share: Real, wide: float) -> Real:
    """Return the weight w of D p = (p₊ - p) - w (p₊₊ - 3p₊ + 3p - p₋) in the faces along one axis.

    It is 0 if the face before or the face after is closed. It is smaller where the grains end,
    because the gradient jumps there: half of the weight has the lowest error on grids of 3 to 4 mm.
    """
    if not wide:
        return np.zeros(area.shape)
    around = [np.roll(share, n, axis) for n in (1, 0, -1, -2)]
    jump = np.maximum.reduce(around) - np.minimum.reduce(around)
    is_open = area > 0
    both = is_open & np.roll(is_open, 1, axis) & np.roll(is_open, -1, axis)
    return np.where(both, wide * (1 - jump / 2), 0.0)


def _capacity(
    cells: Cells, air: Fluid, dt: float, share: Real, grains: Packed | None
) -> tuple[Real, Real, Real]:
    """Return the capacity of the cells (m³/Pa), its relaxing parts (POLES, nz, ny, nx) and their
    rates (POLES,)."""
    capacity = cells.volume * (1 - share) * air.compressibility
    relaxing = np.zeros((POLES, *cells.shape))
    rates = np.zeros(POLES)
    if grains is not None:
        dense = cells.volume * share * grains.fluid.compressibility * grains.ratio
        capacity = capacity + dense
        for j, (c, tau) in enumerate(zip(grains.fluid.strengths, grains.fluid.times, strict=True)):
            half = dt / (2 * tau)
            relaxing[j] = dense * c
            rates[j] = half / (1 + half)
    return capacity, relaxing, rates


def _fastest_gain(gain: list[Real], decay: list[Real]) -> list[Real]:
    """Return the gain 2b/(1+a) of faces without drag that limit the time step in the same way as
    faces of gain b and decay a.

    A mode p₊ = p + βU₊, U₊ = aU - βp has the determinant a and the trace 1 + a - β². It is stable
    up to β² = 2(1+a), which for large drag is half of the value without drag.
    """
    return [2 * b / (1 + a) for b, a in zip(gain, decay, strict=True)]


def _row_sums(gain: list[Real], weight: list[Real]) -> Real:
    """Return Σ|DᵀbD| of each cell, for the gain b.

    If M is at least Δt/4 of this sum, all eigenvalues are in the stable range (Gershgorin), for any
    shape of the cut cells.
    """
    total = np.zeros(gain[0].shape)
    for g, w, axis in zip(gain, weight, (2, 1, 0), strict=True):
        near = g * (2 + 8 * w) * (1 + 3 * w)
        far = g * (2 + 8 * w) * w
        total += near + np.roll(near, 1, axis) + np.roll(far, -1, axis) + np.roll(far, 2, axis)
    return total


def _share_out(capacity: Real, least: Real) -> Real:
    """Return the capacity after cells with less than `least` received capacity from neighbours.

    The total does not change, and so the resonances do not change to first order in the grid. Added
    capacity would lower them by half of the added share.
    """
    live = least > 0
    mass = capacity.copy()
    for _ in range(ROUNDS):
        lack = np.where(live, np.maximum(least - mass, 0), 0)
        if not lack.any():
            break
        spare = np.where(live, np.maximum(mass - least, 0), 0)
        near = _around(spare)
        # Each of the six neighbours gives at most a sixth of its spare capacity to a cell, so it
        # does not give more than it has.
        ask = np.minimum(np.divide(lack, near, out=np.zeros_like(lack), where=near > 0), 1 / 6)
        mass += ask * near - spare * _around(ask)
    return mass


def _around(values: Real) -> Real:
    """Return the sum over the neighbours of each cell, up to six."""
    total = np.zeros(values.shape)
    for axis in range(3):
        sums = total.swapaxes(0, axis)
        cells = values.swapaxes(0, axis)
        sums[1:] += cells[:-1]
        sums[:-1] += cells[1:]
    return total


def _pressure(
    mass: Real, relaxing: Real, rates: Real, walls: WallList, dt: float
) -> tuple[Real, Real, list[Real]]:
    """Return yield, keep and the returns of both poles: the coefficients of the pressure.

    Poles and walls are eliminated. A wall that only resists has no state, so it is completely in
    `keep`, and is not a wall of the kernel.
    """
    safe = np.where(mass > 0, mass, 1.0)
    admittance = _admittance(walls, dt)
    moving = _is_moving(walls)

    def load(chosen: NDArray[np.bool_]) -> Real:
        conductance = np.bincount(walls.cell, walls.area * admittance * chosen, minlength=mass.size)
        return dt * conductance.reshape(mass.shape) / (2 * safe)

    reacting = load(moving)
    resisting = load(~moving)
    poles = [rate * strength / safe for rate, strength in zip(rates, relaxing, strict=True)]
    denominator = 1 + sum(poles) + reacting + resisting
    yield_ = np.where(mass > 0, dt / (safe * denominator), 0.0)
    keep = (1 + reacting - resisting - sum(poles)) / denominator
    return yield_, keep, [2 * pole / denominator for pole in poles]


def _admittance(walls: WallList, dt: float) -> Real:
    """Return the admittance per area (m/(Pa s), (walls,)) of walls in a time step."""
    impedance = 2 * walls.mass / dt + walls.resistance + walls.stiffness * dt / 2
    return 1 / np.maximum(impedance, WEAKEST)


def _is_moving(walls: WallList) -> NDArray[np.bool_]:
    """Return which walls have a mass or a spring, and so a state."""
    return (walls.mass > 0) | (walls.stiffness > 0)


def _moving_walls(walls: WallList, yield_: Real, dt: float, dtype: type) -> Walls:
    """Return the walls of the kernel; `yield_` is flat."""
    admittance = _admittance(walls, dt)
    moving = _is_moving(walls)
    terms = (
        yield_[walls.cell] * walls.area * admittance,
        admittance,
        2 * walls.mass / dt,
        walls.stiffness * dt / 2,
    )
    cell = walls.cell.astype(np.uint64)[moving]
    return Walls(cell, *(_flat(term[moving], dtype) for term in terms))


def _flat(array: Real, dtype: type) -> NDArray:
    """Return an aligned flat copy."""
    flat = aligned(array.size, dtype)
    flat[:] = array.ravel()
    return flat


def aligned(size: int, dtype: DTypeLike) -> NDArray:
    """Return zeros (size,) that begin with a cache line."""
    nbytes = size * np.dtype(dtype).itemsize
    room = np.zeros(nbytes + LINE, np.uint8)
    start = -room.ctypes.data % LINE
    return room[start : start + nbytes].view(dtype)


def _span(live: NDArray[np.bool_], grains: NDArray[np.bool_]) -> Span:
    """Return the live cells of each slab in whole vectors, and the number of slabs with grains."""
    nz, ny, nx = live.shape
    slab = ny * nx
    flat = live.reshape(nz, slab)
    base = np.arange(nz) * slab
    is_live = flat.any(axis=1)
    first = np.where(is_live, base + flat.argmax(axis=1), base)
    last = np.where(is_live, base + slab - flat[:, ::-1].argmax(axis=1), base)
    # Only the cells of the slab itself, because those of the next slab must not change yet.
    lo = np.maximum(first // LANES * LANES, base)
    hi = np.where(is_live, np.minimum(-(-last // LANES) * LANES, base + slab), lo)
    wet = np.flatnonzero((live & grains).any(axis=(1, 2)))
    # The faces above the topmost grains have half of their drag. They belong to the slab of these
    # grains, so the number of slabs is not larger by one.
    slabs = int(wet[-1]) + 1 if len(wet) else 0
    return Span(lo.astype(np.uint64), hi.astype(np.uint64), slabs, nx, slab)
