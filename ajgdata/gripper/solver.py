"""The kernel: a staggered leapfrog in pressure and volume velocity, one horizontal slab at a time.

A step is U <- decay U - gain Dp, then p <- keep p + Σ return_j q_j - yield D*U, then source, walls
and modes. D p = (p₊ - p) - reach (p₊₊ - p₋) is the four-point difference, and D* is its adjoint.
The state of a relaxing density q is r = q - rate p at the start of a step. It does not depend on
the changes of p by source, walls and modes at the end of a step, so they do not update it.

- Velocity and pressure of a slab are updated while the slab is in the first-level cache.
- Indices are unsigned: without negative indices, the compiler vectorises every loop.
- There is no fast-math. The order of all operations is fixed, so the result does not depend on the
  vector width of the machine.
- The kernel has no literal factors, because they would turn float32 into float64.
- All functions that the kernel calls are in this file, because numba compiles a cached kernel again
  only if its own file changes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, uint64
from numpy.typing import NDArray

from ajgdata.gripper.system import System, aligned

Real = NDArray[np.floating]


class State(NamedTuple):
    """State of the wave field, walls and modes.

    The pressure p (Pa), the volume velocities u of the faces, and r = q - rate p of both poles are
    flat arrays over the cells. The walls have arrays (W,): `momentum` 2m v/Δt, `tension` k x, and
    the pressure `before`. `motion` (3, N) is that of the modes, see `_swing`.
    """

    p: NDArray
    ux: NDArray
    uy: NDArray
    uz: NDArray
    r1: NDArray
    r2: NDArray
    momentum: NDArray
    tension: NDArray
    before: NDArray
    motion: NDArray


class Patches(NamedTuple):
    """Patches whose pressure is recorded: cells (flat index), with the patch and weight of each."""

    cell: NDArray
    patch: NDArray
    weight: NDArray


class Probe(NamedTuple):
    """A transducer: cells (flat index) of a small volume, with weights whose sum is 1."""

    cell: NDArray
    weight: NDArray


NO_PATCHES = Patches(np.zeros(0, np.uint64), np.zeros(0, np.int64), np.zeros(0))
UNFELT = np.zeros((0, 0))


def at_rest(system: System) -> State:
    """Return the state of silence of a system."""
    dtype = system.capacities.yield_.dtype
    cells = [aligned(system.mass.size, dtype) for _ in range(6)]
    walls = [aligned(len(system.walls.cell), dtype) for _ in range(3)]
    return State._make([*cells, *walls, np.zeros((3, len(system.modes.inertia)))])


def march(
    system: System,
    state: State,
    source: Probe,
    receiver: Probe,
    drive: Real,
    steps: int,
    patches: Patches = NO_PATCHES,
    felt: Real = UNFELT,
) -> Real:
    """Advance `state` in place by `steps`; return the pressure (Pa) at `receiver` after each step,
    (steps,).

    `drive` (n,) is the volume velocity (m³/s) at `source` in each step, 0 in all later steps. To
    `felt` (patches, m) is added the weighted pressure in `patches` after every (steps / m)-th step,
    beginning with the first. m is a divisor of `steps`.
    """
    out = np.zeros(steps)
    dtype = state.p.dtype
    span = system.span
    _march(
        tuple(state),
        tuple(system.faces),
        tuple(system.reach),
        tuple(system.capacities),
        tuple(system.walls),
        tuple(system.modes),
        (span.lo, span.hi, np.uint64(span.bed_slabs), np.uint64(span.row), np.uint64(span.slab)),
        (source.cell, source.weight.astype(dtype)),
        (receiver.cell, receiver.weight.astype(dtype)),
        tuple(patches),
        np.ascontiguousarray(drive, dtype=dtype),
        out,
        felt,
    )
    return out


@njit(nogil=True, cache=True)
def _march(
    state, faces, reach, capacities, walls, modes, span, source, receiver, patches, drive, out, felt
):
    """Advance the state by len(out) steps, see `march`.

    Arguments are plain tuples, because a cached function does not notice a change of a named tuple.
    They are unpacked once, because passing them on costs reference counts in each step.
    """
    p, _, _, _, _, _, momentum, tension, before, motion = state
    scratch = np.zeros(span[4], p.dtype)
    share = np.zeros_like(before)
    touched = np.zeros((3, len(modes[0])), p.dtype)
    for n in range(len(out)):
        _sweep(state, faces, reach, capacities, span, scratch)
        if n < len(drive):
            _drive(p, capacities[0], source[0], source[1], drive[n])
        _react(p, momentum, tension, before, walls, share, motion, modes, touched)
        out[n] = _listen(p, receiver[0], receiver[1])
        if felt.shape[1] and n % (len(out) // felt.shape[1]) == 0:
            _feel(p, patches[0], patches[1], patches[2], felt, n // (len(out) // felt.shape[1]))


@njit(nogil=True, cache=True)
def _sweep(state, faces, reach, capacities, span, scratch):
    """Advance velocities and pressures by one step, without source, walls and modes."""
    p, ux, uy, uz, r1, r2, _, _, _, _ = state
    decay_x, decay_y, decay_z, gain_x, gain_y, gain_z = faces
    reach_x, reach_y, reach_z = reach
    first, last, bed_slabs, row, slab = span
    unit = uint64(1)
    slabs = len(first)
    # After the velocity along z above a slab, the old pressure of the slab below is not needed any
    # more. Its velocities along x and y are updated only now, so they are still in the cache.
    for above in range(1, slabs):
        lo, hi = first[above], last[above]
        if above < bed_slabs:
            _damped_velocity(uz, decay_z, gain_z, reach_z, p, lo, hi, slab)
        else:
            _velocity(uz, gain_z, reach_z, p, lo, hi, slab)
        k = above - 1
        lo, hi = first[k], last[k]
        if k < bed_slabs:
            _damped_velocity(ux, decay_x, gain_x, reach_x, p, lo, hi, unit)
            _damped_velocity(uy, decay_y, gain_y, reach_y, p, lo, hi, row)
        else:
            _velocity(ux, gain_x, reach_x, p, lo, hi, unit)
            _velocity(uy, gain_y, reach_y, p, lo, hi, row)
        _divergence(scratch, ux, uy, uz, reach_x, reach_y, reach_z, lo, hi, row, slab)
        if k < bed_slabs:
            _relax(p, r1, r2, capacities, scratch, lo, hi)
        else:
            _pressure(p, capacities[1], capacities[0], scratch, lo, hi)


@njit(nogil=True, cache=True)
def _velocity(u, gain, reach, p, lo, hi, step):
    """Advance the volume velocity in air along one axis, whose neighbours are `step` apart."""
    for i in range(lo, hi):
        u[i] -= gain[i] * ((p[i + step] - p[i]) - reach[i] * (p[i + step + step] - p[i - step]))


@njit(nogil=True, cache=True)
def _damped_velocity(u, decay, gain, reach, p, lo, hi, step):
    """Advance the volume velocity in the grains along one axis."""
    for i in range(lo, hi):
        rise = (p[i + step] - p[i]) - reach[i] * (p[i + step + step] - p[i - step])
        u[i] = decay[i] * u[i] - gain[i] * rise


@njit(nogil=True, cache=True)
def _divergence(into, ux, uy, uz, rx, ry, rz, lo, hi, row, slab):
    """Set `into` to D*U of the cells of a slab."""
    unit = uint64(1)
    for i in range(lo, hi):
        out = (ux[i] - ux[i - unit]) + (uy[i] - uy[i - row]) + (uz[i] - uz[i - slab])
        x = rx[i + unit] * ux[i + unit] - rx[i - unit - unit] * ux[i - unit - unit]
        y = ry[i + row] * uy[i + row] - ry[i - row - row] * uy[i - row - row]
        z = rz[i + slab] * uz[i + slab] - rz[i - slab - slab] * uz[i - slab - slab]
        into[i - lo] = out - (x + y + z)


@njit(nogil=True, cache=True)
def _pressure(p, keep, yield_, out, lo, hi):
    """Advance the pressure in air; `out` is D*U."""
    for i in range(lo, hi):
        p[i] = keep[i] * p[i] - yield_[i] * out[i - lo]


@njit(nogil=True, cache=True)
def _relax(p, r1, r2, capacities, out, lo, hi):
    """Advance the pressure and the relaxing densities in the grains; `out` is D*U."""
    yield_, keep, return1, return2, rates = capacities
    rate1, rate2, fall1, fall2 = rates[0], rates[1], rates[2], rates[3]
    for i in range(lo, hi):
        old = p[i]
        push1 = rate1 * old
        push2 = rate2 * old
        q1 = r1[i] + push1
        q2 = r2[i] + push2
        p[i] = keep[i] * old + return1[i] * q1 + return2[i] * q2 - yield_[i] * out[i - lo]
        r1[i] = fall1 * q1 + push1
        r2[i] = fall2 * q2 + push2


@njit(nogil=True, cache=True)
def _drive(p, yield_, cell, weight, flow):
    """Add the volume velocity `flow` in the cells of a probe."""
    for m in range(len(cell)):
        p[cell[m]] += yield_[cell[m]] * weight[m] * flow


@njit(nogil=True, cache=True)
def _react(p, momentum, tension, before, walls, share, motion, modes, touched):
    """Advance all walls and modes: first their effect on the pressures, then the walls' motion.

    `share` (walls,) and `touched` (3, cells of the modes) are workspace.
    """
    cell, coupling, admittance, inertia, half_spring = walls
    # Gathering, computing and scattering are separate loops, so that the computation vectorises.
    for n in range(len(cell)):
        share[n] = coupling[n] * (before[n] + (momentum[n] - tension[n]))
    for n in range(len(cell)):
        p[cell[n]] -= share[n]
    if len(modes[5]):
        _swing(p, motion, modes, touched)
    for n in range(len(cell)):
        share[n] = p[cell[n]]
    for n in range(len(cell)):
        new = share[n]
        force = momentum[n] - tension[n]
        # w is twice the mean velocity of the step. The updates are v <- w - v and x <- x + Δt w/2;
        # v and x are stored as forces.
        w = admittance[n] * ((before[n] + force) + (new + force))
        momentum[n] = inertia[n] * w - momentum[n]
        tension[n] += half_spring[n] * w
        before[n] = new


@njit(nogil=True, cache=True)
def _swing(p, motion, modes, touched):
    """Advance all modes; `motion` (3, N) has 2m v/Δt, k x and W p of the previous step.

    `touched` (3, cells) is workspace.
    """
    cell, weight, half_yield, inverse, gram, inertia, half_spring = modes
    count = len(inertia)
    pressure, scratch, taken = touched[0], touched[1], touched[2]
    drive = np.empty(count)
    w = np.zeros(count)
    for j in range(len(cell)):
        pressure[j] = p[cell[j]]
    for n in range(count):
        drive[n] = _dot(weight[n], pressure, scratch)
    for n in range(count):
        for m in range(count):
            force = motion[0, m] - motion[1, m]
            w[n] += inverse[n, m] * ((motion[2, m] + force) + (drive[m] + force))
    taken[:] = 0
    for n in range(count):
        felt = drive[n]
        for m in range(count):
            felt -= gram[n, m] * w[m]
        motion[0, n] = inertia[n] * w[n] - motion[0, n]
        motion[1, n] += half_spring[n] * w[n]
        motion[2, n] = felt
        _add(taken, weight[n], p.dtype.type(w[n]))
    for j in range(len(cell)):
        taken[j] *= half_yield[j]
    for j in range(len(cell)):
        p[cell[j]] -= taken[j]


@njit(nogil=True, cache=True)
def _dot(weight, pressure, scratch):
    """Return Σ weight · pressure, summed by halves.

    This vectorises without a permission to reorder a sum, and has smaller rounding errors.
    """
    left = len(pressure)
    for j in range(left):
        scratch[j] = weight[j] * pressure[j]
    while left > 1:
        half = (left + 1) // 2
        for j in range(left - half):
            scratch[j] += scratch[j + half]
        left = half
    return scratch[0]


@njit(nogil=True, cache=True)
def _add(into, weight, times):
    """Add `weight` times a number to `into`."""
    for j in range(len(into)):
        into[j] += weight[j] * times


@njit(nogil=True, cache=True)
def _listen(p, cell, weight):
    """Return the pressure at a probe."""
    pressure = 0.0
    for m in range(len(cell)):
        pressure += weight[m] * p[cell[m]]
    return pressure


@njit(nogil=True, cache=True)
def _feel(p, cell, patch, weight, sums, n):
    """Add the weighted pressure of each patch to column `n` of `sums`."""
    for m in range(len(cell)):
        sums[patch[m], n] += weight[m] * p[cell[m]]
