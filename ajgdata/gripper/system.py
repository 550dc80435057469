"""Cut cells + fluids + walls -> the coefficients that the kernel marches.

In a cell of capacity M = V C the pressure p and the relaxing densities q obey
M dp/dt + Σ M c_j dq_j/dt = -Σ U - Σ S v,  τ_j dq_j/dt = p - q_j, and each locally reacting wall of
area S obeys m dv/dt + r v + k ∫v dt = p. Drag in the faces is integrated exactly; poles and walls
by the trapezoidal rule, solved for the new pressure in closed form.
"""

from __future__ import annotations

from collections.abc import Iterator
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
Integer = NDArray[np.int64]
MARGIN = 1.0005
POLES = 2
#: Of sharing out capacity; a dozen suffices in every scene seen.
ROUNDS = 40
#: Bytes of a cache line: arrays begin where one does, because loads across two take twice the time.
LINE = 64


class Faces(NamedTuple):
    """U <- decay U - gain (p₊ - p), in flat arrays, for the three directions.

    The U are (1 + 3w) times the volume velocity, the gains (1 + 3w)² times.
    """

    decay_x: NDArray
    decay_y: NDArray
    decay_z: NDArray
    gain_x: NDArray
    gain_y: NDArray
    gain_z: NDArray


class Reach(NamedTuple):
    """w/(1 + 3w) of the faces, flat, with the weight w of the four-point difference."""

    x: NDArray
    y: NDArray
    z: NDArray


class Capacities(NamedTuple):
    """p <- keep p_old + Σ return_j q_j - yield_ ΣU; q_j <- q_j + rate_j (p + p_old - 2 q_j).

    `rates` (4,): both rates, and 1 - 2 rate of both.
    """

    yield_: NDArray
    keep: NDArray
    return1: NDArray
    return2: NDArray
    rates: NDArray


class Span(NamedTuple):
    """Active cells of each slab are in lo <= i < hi; the grains lie in the first `bed_slabs`."""

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
    wide: float = 0.0,
) -> System:
    """Coefficients for time step `dt` (s); `wide` is the weight of the four-point differences.

    `added_volume` is the fraction of the capacity added for stability, `raised_cells` the share of
    cells that took capacity from their neighbours for the same reason.
    """
    share = _grain_share(cells, grains)
    decay, gain, weight = _face_terms(cells, share, dt, air, grains, wide)
    capacity, relaxing, rates = _capacity(cells, air, dt, share, grains)
    least = MARGIN * dt / 4 * _row_sums(_fastest_gain(gain, decay), weight)
    live = least > 0
    mass = np.where(live, np.maximum(_share_out(capacity, least), least), 0.0)
    added = float((mass - capacity)[live].sum() / capacity.sum())
    raised = float(np.mean((least > capacity)[live]))
    walls = connected(walls, live)
    capacities, wall_terms = _pressure(mass, relaxing, rates, walls, dt)
    gain = tuple(g * (1 + 3 * w) ** 2 for g, w in zip(gain, weight, strict=True))
    reach = (w / (1 + 3 * w) for w in weight)
    return System(
        cells.shape,
        dt,
        Faces(*(_flat(array, dtype) for array in (*decay, *gain))),
        Reach(*(_flat(array, dtype) for array in reach)),
        Capacities(*(_flat(a, dtype) for a in (*capacities, np.append(rates, 1 - 2 * rates)))),
        Walls(wall_terms[0], *(_flat(a, dtype) for a in wall_terms[1:])),
        coupled(modes, capacities[0].ravel(), dt, dtype),
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


def _face_terms(
    cells: Cells, share: Real, dt: float, air: Fluid, grains: Packed | None, wide: float
) -> Iterator[tuple[Real, ...]]:
    """Return decay, gain and weight of the faces, each along x, y and z."""
    areas = ((cells.area_x, 2), (cells.area_y, 1), (cells.area_z, 0))
    terms = (
        (*_face(area, axis, share, cells.h, dt, air, grains), _weight(area, axis, share, wide))
        for area, axis in areas
    )
    return zip(*terms, strict=True)


def _capacity(
    cells: Cells, air: Fluid, dt: float, share: Real, grains: Packed | None
) -> tuple[Real, Real, Real]:
    """Capacity of the cells (m³/Pa), its relaxing parts (POLES, …) and their rates (POLES,)."""
    capacity = cells.volume * (1 - share) * air.compressibility
    relaxing, rates = np.zeros((POLES, *cells.shape)), np.zeros(POLES)
    if grains is not None:
        dense = cells.volume * share * grains.fluid.compressibility * grains.ratio
        capacity = capacity + dense
        for j, (c, tau) in enumerate(zip(grains.fluid.strengths, grains.fluid.times, strict=True)):
            relaxing[j] = dense * c
            rates[j] = (half := dt / (2 * tau)) / (1 + half)
    return capacity, relaxing, rates


def _weight(area: Real, axis: int, share: Real, wide: float) -> Real:
    """Weight w of D p = (p₊ - p) - w (p₊₊ - 3p₊ + 3p - p₋) in the faces along one axis.

    Only where the faces before and after are open too, and less where the grains end, because the
    gradient jumps there: half of it has the lowest error on grids of 3 to 4 mm.
    """
    if not wide:
        return np.zeros(area.shape)
    around = [np.roll(share, n, axis) for n in (1, 0, -1, -2)]
    jump = np.maximum.reduce(around) - np.minimum.reduce(around)
    open_ = area > 0
    both = open_ & np.roll(open_, 1, axis) & np.roll(open_, -1, axis)
    return np.where(both, wide * (1 - jump / 2), 0.0)


def _fastest_gain(gain: tuple[Real, ...], decay: tuple[Real, ...]) -> tuple[Real, ...]:
    """Gain 2b/(1+a) of a face without drag that limits the time step as one of gain b and decay a.

    A mode p₊ = p + βU₊, U₊ = aU - βp has determinant a and trace 1 + a - β², and is stable up to
    β² = 2(1+a), twice as early with much drag as without.
    """
    return tuple(2 * b / (1 + a) for b, a in zip(gain, decay, strict=True))


def _row_sums(gain: tuple[Real, ...], weight: tuple[Real, ...]) -> Real:
    """Σ|DᵀbD| of each cell. Gershgorin: with M ≥ Δt/4 of that, no eigenvalue leaves the stable
    range, however a cell is cut."""
    total = np.zeros(gain[0].shape)
    for g, w, axis in zip(gain, weight, (2, 1, 0), strict=True):
        near, far = g * (2 + 8 * w) * (1 + 3 * w), g * (2 + 8 * w) * w
        total += near + np.roll(near, 1, axis) + np.roll(far, -1, axis) + np.roll(far, 2, axis)
    return total


def _share_out(capacity: Real, least: Real) -> Real:
    """Give cells that need more capacity for stability what their open neighbours can spare.

    The total stays what it is, and with it the resonances to first order in the grid; adding
    instead would lower them by half the share that is added.
    """
    live, mass = least > 0, capacity.copy()
    for _ in range(ROUNDS):
        lack = np.where(live, np.maximum(least - mass, 0), 0)
        if not lack.any():
            break
        spare = np.where(live, np.maximum(mass - least, 0), 0)
        near = _around(spare)
        # At most a sixth of what each of six neighbours can spare: nobody gives more than it has.
        ask = np.minimum(np.divide(lack, near, out=np.zeros_like(lack), where=near > 0), 1 / 6)
        mass += ask * near - spare * _around(ask)
    return mass


def _around(values: Real) -> Real:
    """Sum over the up to six neighbours of each cell."""
    total = np.zeros(values.shape)
    for axis in range(3):
        into, of = total.swapaxes(0, axis), values.swapaxes(0, axis)
        into[1:] += of[:-1]
        into[:-1] += of[1:]
    return total


def aligned(size: int, dtype: DTypeLike) -> NDArray:
    """Return zeros, (size,), that begin where a cache line does."""
    nbytes = size * np.dtype(dtype).itemsize
    room = np.zeros(nbytes + LINE, np.uint8)
    start = -room.ctypes.data % LINE
    return room[start : start + nbytes].view(dtype)


def _flat(array: Real, dtype: type) -> NDArray:
    flat = aligned(array.size, dtype)
    flat[:] = array.ravel()
    return flat


def _face(
    area: Real, axis: int, share: Real, h: float, dt: float, air: Fluid, grains: Packed | None
) -> tuple[Real, Real]:
    """Decay and gain of the faces along one axis.

    The grains end in a nearly horizontal surface: along z the two media act in series, where they
    really are in the half cells at either side; along x and y they act in parallel.
    """
    density, drag = np.full(share.shape, air.density), np.zeros(share.shape)
    if grains is not None:
        ratio = (grains.ratio + np.roll(grains.ratio, -1, axis)) / 2
        local, mean = ratio * grains.porosity, grains.porosity
        tortuous = grains.fluid.density * ratio**-1.5
        resisting = grains.fluid.drag * ((1 - local) / (1 - mean)) ** 2 / ratio**3
        if axis == 0:
            lower, upper = np.minimum(2 * share, 1), np.maximum(2 * share - 1, 0)
            wet = (upper + np.roll(lower, -1, axis)) / 2
            density = density + wet * (tortuous - air.density)
            drag = wet * resisting
        else:
            wet = (share + np.roll(share, -1, axis)) / 2
            density = 1 / ((1 - wet) / air.density + wet / tortuous)
            drag = density**2 * wet * resisting / tortuous**2
    exponent = drag * dt / density
    # (1 - e^-s)/s by expm1, exact as the drag vanishes.
    slow = np.where(exponent > 0, -np.expm1(-exponent) / np.where(exponent > 0, exponent, 1), 1.0)
    return np.exp(-exponent), area / h * dt / density * slow


def _pressure(
    mass: Real, relaxing: Real, rates: Real, walls: WallList, dt: float
) -> tuple[tuple[Real, ...], tuple[NDArray, ...]]:
    """Coefficients of the pressure update with poles and walls eliminated.

    A wall that only resists remembers nothing: it is wholly in `keep` and no wall of the kernel's.
    """
    safe = np.where(mass > 0, mass, 1.0)
    impedance = 2 * walls.mass / dt + walls.resistance + walls.stiffness * dt / 2
    z = 1 / np.maximum(impedance, WEAKEST)
    moving = (walls.mass > 0) | (walls.stiffness > 0)

    def loads(some: NDArray[np.bool_]) -> Real:
        conductance = np.bincount(walls.cell, walls.area * z * some, minlength=mass.size)
        return dt * conductance.reshape(mass.shape) / (2 * safe)

    reacting, resisting = loads(moving), loads(~moving)
    poles = [rate * strength / safe for rate, strength in zip(rates, relaxing, strict=True)]
    denominator = 1 + sum(poles) + reacting + resisting
    yield_ = np.where(mass > 0, dt / (safe * denominator), 0.0)
    keep = (1 + reacting - resisting - sum(poles)) / denominator
    returns = [2 * pole / denominator for pole in poles]
    coupling = yield_.ravel()[walls.cell] * walls.area * z
    cell = walls.cell.astype(np.uint64)
    terms = (cell, coupling, z, 2 * walls.mass / dt, walls.stiffness * dt / 2)
    return (yield_, keep, *returns), tuple(term[moving] for term in terms)


def _span(live: NDArray[np.bool_], grains: NDArray[np.bool_]) -> Span:
    """First and last active cell of each slab, in whole vectors, and how many slabs hold grains."""
    nz, ny, nx = live.shape
    slab = ny * nx
    flat, base = live.reshape(nz, slab), np.arange(nz) * slab
    some = flat.any(axis=1)
    first = np.where(some, base + flat.argmax(axis=1), base)
    last = np.where(some, base + slab - flat[:, ::-1].argmax(axis=1), base)
    # A slab's own cells only: those of the next must not move yet.
    lo = np.maximum(first // LANES * LANES, base)
    hi = np.where(some, np.minimum(-(-last // LANES) * LANES, base + slab), lo)
    wet = np.flatnonzero((live & grains).any(axis=(1, 2)))
    # A face above the topmost grains still feels half of their drag, hence + 1 below, not above:
    # it belongs to the slab of the grains themselves.
    slabs = int(wet[-1]) + 1 if len(wet) else 0
    return Span(lo.astype(np.uint64), hi.astype(np.uint64), slabs, nx, slab)
