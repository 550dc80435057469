"""Variants of the wide kernel, on the grid of one grasp: time of a sweep and error of the field.

Run `python benchmarks/kernel.py`; it prints the table of docs/virtual-gripper.md. All march the
same scene from the same random pressures on one core, without walls and modes, interleaved. Time is
that of the process, the median of the ratios to today's kernel and the least of the times; the
error is that of the pressure after as many steps, relative to the same march in float64 (L2).
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Mapping
from time import process_time

os.environ["OMP_NUM_THREADS"] = "1"

import numpy as np
from numba import float32, njit, uint64
from numpy.typing import NDArray

from ajgdata.gripper import Scene, build_plan
from ajgdata.gripper.solver import (
    _damped_wide_velocity,
    _empty,
    _relax,
    _wide_divergence,
    _wide_sweep,
    _wide_velocity,
    at_rest,
)
from ajgdata.gripper.system import System, aligned

#: Marches `steps` from the start and returns the pressure (cells,).
Run = Callable[[int], NDArray]


@njit(nogil=True, cache=True)
def marched(steps, state, faces, reach, capacities, span, scratch):
    for _ in range(steps):
        _wide_sweep(state, faces, reach, capacities, span, scratch)


def today(system: System, start: NDArray) -> Run:
    """What is in ajgdata.gripper.solver."""
    state, given, scratch = begun(system, start)
    return run(marched, state, start, given, scratch)


def begun(system: System, start: NDArray) -> tuple[tuple, tuple, NDArray]:
    state, span = at_rest(system), system.span
    numbers = (np.uint64(n) for n in (span.bed_slabs, span.row, span.slab))
    given = (
        tuple(system.faces),
        tuple(system.reach),
        tuple(system.capacities),
        (span.lo, span.hi, *numbers),
    )
    return tuple(state), given, aligned(span.slab, start.dtype)


def run(kernel: Callable, state: tuple, start: NDArray, given: tuple, *room: object) -> Run:
    def marching(steps: int) -> NDArray:
        for array in state:
            array[...] = 0
        state[0][:] = start
        kernel(steps, state, *given, *room)
        return state[0]

    return marching


# Reach as one byte, in 255ths of the largest: a face and its adjoint read the same, so that energy
# is still conserved.


@njit(nogil=True, cache=True)
def byte_velocity(u, decay, gain, reach, unit, p, lo, hi, step):
    for i in range(lo, hi):
        far = unit * float32(reach[i]) * (p[i + step + step] - p[i - step])
        u[i] = decay[i] * u[i] - gain[i] * ((p[i + step] - p[i]) - far)


@njit(nogil=True, cache=True)
def byte_free_velocity(u, gain, reach, unit, p, lo, hi, step):
    for i in range(lo, hi):
        far = unit * float32(reach[i]) * (p[i + step + step] - p[i - step])
        u[i] -= gain[i] * ((p[i + step] - p[i]) - far)


@njit(nogil=True, cache=True)
def byte_divergence(into, ux, uy, uz, rx, ry, rz, unit, lo, hi, row, slab):
    one = uint64(1)
    two, rows, slabs = one + one, row + row, slab + slab
    for i in range(lo, hi):
        out = (ux[i] - ux[i - one]) + (uy[i] - uy[i - row]) + (uz[i] - uz[i - slab])
        x = float32(rx[i + one]) * ux[i + one] - float32(rx[i - two]) * ux[i - two]
        y = float32(ry[i + row]) * uy[i + row] - float32(ry[i - rows]) * uy[i - rows]
        z = float32(rz[i + slab]) * uz[i + slab] - float32(rz[i - slabs]) * uz[i - slabs]
        into[i - lo] = out - unit * (x + y + z)


@njit(nogil=True, cache=True)
def byte_marched(steps, state, faces, reach, capacities, span, unit, scratch):
    p, ux, uy, uz, r1, r2 = state[:6]
    decay_x, decay_y, decay_z, gain_x, gain_y, gain_z = faces
    rx, ry, rz = reach
    first, last, bed, row, slab = span
    one = uint64(1)
    for _ in range(steps):
        for above in range(1, len(first)):
            lo, hi = first[above], last[above]
            if above < bed:
                byte_velocity(ux, decay_x, gain_x, rx, unit, p, lo, hi, one)
                byte_velocity(uy, decay_y, gain_y, ry, unit, p, lo, hi, row)
                byte_velocity(uz, decay_z, gain_z, rz, unit, p, lo, hi, slab)
            else:
                byte_free_velocity(ux, gain_x, rx, unit, p, lo, hi, one)
                byte_free_velocity(uy, gain_y, ry, unit, p, lo, hi, row)
                byte_free_velocity(uz, gain_z, rz, unit, p, lo, hi, slab)
            lo, hi = first[above - 1], last[above - 1]
            byte_divergence(scratch, ux, uy, uz, rx, ry, rz, unit, lo, hi, row, slab)
            if above - 1 < bed:
                _relax(p, r1, r2, capacities, scratch, lo, hi)
            else:
                _empty(p, capacities[1], capacities[0], scratch, lo, hi)


def bytes_of_reach(system: System, start: NDArray) -> Run:
    state, (faces, reach, capacities, span), scratch = begun(system, start)
    unit = max(float(r.max()) for r in reach) / 255
    held = tuple(copied(np.round(r / unit).astype(np.uint8)) for r in reach)
    given = (faces, held, capacities, span, np.float32(unit))
    return run(byte_marched, state, start, given, scratch)


def copied(array: NDArray) -> NDArray:
    out = aligned(array.size, array.dtype)
    out[:] = array
    return out


# Coefficients of 16 bits, in 65535ths of the largest.


@njit(nogil=True, cache=True)
def short_velocity(u, decay, gain, unit, reach, p, lo, hi, step):
    full = float32(1 / 65535)
    for i in range(lo, hi):
        rise = (p[i + step] - p[i]) - reach[i] * (p[i + step + step] - p[i - step])
        u[i] = (full * float32(decay[i])) * u[i] - (unit * float32(gain[i])) * rise


@njit(nogil=True, cache=True)
def short_free_velocity(u, gain, unit, reach, p, lo, hi, step):
    for i in range(lo, hi):
        rise = (p[i + step] - p[i]) - reach[i] * (p[i + step + step] - p[i - step])
        u[i] -= (unit * float32(gain[i])) * rise


@njit(nogil=True, cache=True)
def short_marched(steps, state, faces, reach, capacities, span, unit, scratch):
    p, ux, uy, uz, r1, r2 = state[:6]
    decay_x, decay_y, decay_z, gain_x, gain_y, gain_z = faces
    rx, ry, rz = reach
    first, last, bed, row, slab = span
    one = uint64(1)
    for _ in range(steps):
        for above in range(1, len(first)):
            lo, hi = first[above], last[above]
            if above < bed:
                short_velocity(ux, decay_x, gain_x, unit, rx, p, lo, hi, one)
                short_velocity(uy, decay_y, gain_y, unit, ry, p, lo, hi, row)
                short_velocity(uz, decay_z, gain_z, unit, rz, p, lo, hi, slab)
            else:
                short_free_velocity(ux, gain_x, unit, rx, p, lo, hi, one)
                short_free_velocity(uy, gain_y, unit, ry, p, lo, hi, row)
                short_free_velocity(uz, gain_z, unit, rz, p, lo, hi, slab)
            lo, hi = first[above - 1], last[above - 1]
            _wide_divergence(scratch, ux, uy, uz, rx, ry, rz, lo, hi, row, slab)
            if above - 1 < bed:
                _relax(p, r1, r2, capacities, scratch, lo, hi)
            else:
                _empty(p, capacities[1], capacities[0], scratch, lo, hi)


def shorts(system: System, start: NDArray) -> Run:
    state, (faces, reach, capacities, span), scratch = begun(system, start)
    unit = max(float(gain.max()) for gain in faces[3:]) / 65535
    units = [1 / 65535] * 3 + [unit] * 3
    held = tuple(
        copied(np.round(face / one).astype(np.uint16))
        for face, one in zip(faces, units, strict=True)
    )
    given = (held, reach, capacities, span, np.float32(unit))
    return run(short_marched, state, start, given, scratch)


# Along x and y only the slab itself is needed: its velocities just before its pressure.


@njit(nogil=True, cache=True)
def late_marched(steps, state, faces, reach, capacities, span, scratch):
    p, ux, uy, uz, r1, r2 = state[:6]
    decay_x, decay_y, decay_z, gain_x, gain_y, gain_z = faces
    rx, ry, rz = reach
    first, last, bed, row, slab = span
    one = uint64(1)
    for _ in range(steps):
        for above in range(1, len(first)):
            lo, hi = first[above], last[above]
            if above < bed:
                _damped_wide_velocity(uz, decay_z, gain_z, rz, p, lo, hi, slab)
            else:
                _wide_velocity(uz, gain_z, rz, p, lo, hi, slab)
            lo, hi = first[above - 1], last[above - 1]
            if above - 1 < bed:
                _damped_wide_velocity(ux, decay_x, gain_x, rx, p, lo, hi, one)
                _damped_wide_velocity(uy, decay_y, gain_y, ry, p, lo, hi, row)
            else:
                _wide_velocity(ux, gain_x, rx, p, lo, hi, one)
                _wide_velocity(uy, gain_y, ry, p, lo, hi, row)
            _wide_divergence(scratch, ux, uy, uz, rx, ry, rz, lo, hi, row, slab)
            if above - 1 < bed:
                _relax(p, r1, r2, capacities, scratch, lo, hi)
            else:
                _empty(p, capacities[1], capacities[0], scratch, lo, hi)


def late(system: System, start: NDArray) -> Run:
    state, given, scratch = begun(system, start)
    return run(late_marched, state, start, given, scratch)


# Divergence by axis, added up: fewer streams a loop.


@njit(nogil=True, cache=True)
def near_divergence(into, ux, uy, rx, ry, lo, hi, row):
    one = uint64(1)
    two, rows = one + one, row + row
    for i in range(lo, hi):
        x = rx[i + one] * ux[i + one] - rx[i - two] * ux[i - two]
        y = ry[i + row] * uy[i + row] - ry[i - rows] * uy[i - rows]
        into[i - lo] = ((ux[i] - ux[i - one]) + (uy[i] - uy[i - row])) - (x + y)


@njit(nogil=True, cache=True)
def relax_z(p, r1, r2, capacities, out, uz, rz, lo, hi, slab):
    yield_, keep, return1, return2, rates = capacities
    rate1, rate2, fall1, fall2 = rates[0], rates[1], rates[2], rates[3]
    slabs = slab + slab
    for i in range(lo, hi):
        z = rz[i + slab] * uz[i + slab] - rz[i - slabs] * uz[i - slabs]
        flow = out[i - lo] + ((uz[i] - uz[i - slab]) - z)
        old = p[i]
        push1, push2 = rate1 * old, rate2 * old
        q1, q2 = r1[i] + push1, r2[i] + push2
        p[i] = keep[i] * old + return1[i] * q1 + return2[i] * q2 - yield_[i] * flow
        r1[i] = fall1 * q1 + push1
        r2[i] = fall2 * q2 + push2


@njit(nogil=True, cache=True)
def empty_z(p, keep, yield_, out, uz, rz, lo, hi, slab):
    slabs = slab + slab
    for i in range(lo, hi):
        z = rz[i + slab] * uz[i + slab] - rz[i - slabs] * uz[i - slabs]
        p[i] = keep[i] * p[i] - yield_[i] * (out[i - lo] + ((uz[i] - uz[i - slab]) - z))


@njit(nogil=True, cache=True)
def split_marched(steps, state, faces, reach, capacities, span, scratch):
    p, ux, uy, uz, r1, r2 = state[:6]
    decay_x, decay_y, decay_z, gain_x, gain_y, gain_z = faces
    rx, ry, rz = reach
    first, last, bed, row, slab = span
    one = uint64(1)
    for _ in range(steps):
        for above in range(1, len(first)):
            lo, hi = first[above], last[above]
            if above < bed:
                _damped_wide_velocity(uz, decay_z, gain_z, rz, p, lo, hi, slab)
            else:
                _wide_velocity(uz, gain_z, rz, p, lo, hi, slab)
            lo, hi = first[above - 1], last[above - 1]
            if above - 1 < bed:
                _damped_wide_velocity(ux, decay_x, gain_x, rx, p, lo, hi, one)
                _damped_wide_velocity(uy, decay_y, gain_y, ry, p, lo, hi, row)
            else:
                _wide_velocity(ux, gain_x, rx, p, lo, hi, one)
                _wide_velocity(uy, gain_y, ry, p, lo, hi, row)
            near_divergence(scratch, ux, uy, rx, ry, lo, hi, row)
            if above - 1 < bed:
                relax_z(p, r1, r2, capacities, scratch, uz, rz, lo, hi, slab)
            else:
                empty_z(p, capacities[1], capacities[0], scratch, uz, rz, lo, hi, slab)


def split(system: System, start: NDArray) -> Run:
    state, given, scratch = begun(system, start)
    return run(split_marched, state, start, given, scratch)


# A slab in parts, so that what one loop leaves in the first-level cache the next one finds there.


@njit(nogil=True, cache=True)
def parted_marched(steps, state, faces, reach, capacities, span, part, scratch):
    p, ux, uy, uz, r1, r2 = state[:6]
    decay_x, decay_y, decay_z, gain_x, gain_y, gain_z = faces
    rx, ry, rz = reach
    first, last, bed, row, slab = span
    one = uint64(1)
    for _ in range(steps):
        for above in range(1, len(first)):
            begin, end = first[above], last[above]
            done = first[above - 1]
            while begin < end or done < last[above - 1]:
                lo, hi = begin, min(begin + part, end)
                if above < bed:
                    _damped_wide_velocity(ux, decay_x, gain_x, rx, p, lo, hi, one)
                    _damped_wide_velocity(uy, decay_y, gain_y, ry, p, lo, hi, row)
                    _damped_wide_velocity(uz, decay_z, gain_z, rz, p, lo, hi, slab)
                else:
                    _wide_velocity(ux, gain_x, rx, p, lo, hi, one)
                    _wide_velocity(uy, gain_y, ry, p, lo, hi, row)
                    _wide_velocity(uz, gain_z, rz, p, lo, hi, slab)
                begin = hi
                # Below, only what no velocity still to come reads: all of it at the end.
                ready = last[above - 1] if begin >= end else min(begin - slab, last[above - 1])
                lo, hi = done, max(done, ready)
                _wide_divergence(scratch, ux, uy, uz, rx, ry, rz, lo, hi, row, slab)
                if above - 1 < bed:
                    _relax(p, r1, r2, capacities, scratch, lo, hi)
                else:
                    _empty(p, capacities[1], capacities[0], scratch, lo, hi)
                done = hi


def parted(cells: int) -> Callable[[System, NDArray], Run]:
    def made(system: System, start: NDArray) -> Run:
        state, given, scratch = begun(system, start)
        return run(parted_marched, state, start, (*given, np.uint64(cells)), scratch)

    return made


# Reach times velocity kept by the velocity loops instead of computed twice by the divergence.


@njit(nogil=True, cache=True)
def kept_velocity(u, v, decay, gain, reach, p, lo, hi, step):
    for i in range(lo, hi):
        r = reach[i]
        new = decay[i] * u[i] - gain[i] * (
            (p[i + step] - p[i]) - r * (p[i + step + step] - p[i - step])
        )
        u[i] = new
        v[i] = r * new


@njit(nogil=True, cache=True)
def kept_divergence(into, ux, uy, uz, vx, vy, vz, lo, hi, row, slab):
    one = uint64(1)
    two, rows, slabs = one + one, row + row, slab + slab
    for i in range(lo, hi):
        out = (ux[i] - ux[i - one]) + (uy[i] - uy[i - row]) + (uz[i] - uz[i - slab])
        x, y = vx[i + one] - vx[i - two], vy[i + row] - vy[i - rows]
        into[i - lo] = out - (x + y + (vz[i + slab] - vz[i - slabs]))


@njit(nogil=True, cache=True)
def kept_marched(steps, state, faces, reach, capacities, span, kept, scratch):
    p, ux, uy, uz, r1, r2 = state[:6]
    decay_x, decay_y, decay_z, gain_x, gain_y, gain_z = faces
    rx, ry, rz = reach
    vx, vy, vz = kept
    first, last, bed, row, slab = span
    one = uint64(1)
    for _ in range(steps):
        for above in range(1, len(first)):
            lo, hi = first[above], last[above]
            kept_velocity(ux, vx, decay_x, gain_x, rx, p, lo, hi, one)
            kept_velocity(uy, vy, decay_y, gain_y, ry, p, lo, hi, row)
            kept_velocity(uz, vz, decay_z, gain_z, rz, p, lo, hi, slab)
            lo, hi = first[above - 1], last[above - 1]
            kept_divergence(scratch, ux, uy, uz, vx, vy, vz, lo, hi, row, slab)
            if above - 1 < bed:
                _relax(p, r1, r2, capacities, scratch, lo, hi)
            else:
                _empty(p, capacities[1], capacities[0], scratch, lo, hi)


def kept_products(system: System, start: NDArray) -> Run:
    state, given, scratch = begun(system, start)
    kept = tuple(aligned(start.size, start.dtype) for _ in range(3))
    return run(kept_marched, state, start, (*given, kept), scratch)


VARIANTS: Mapping[str, Callable[[System, NDArray], Run]] = {
    "today": today,
    "reach as one byte": bytes_of_reach,
    "drag and gain as 16 bits": shorts,
    "x and y just before the pressure": late,
    "the same, z with the pressure": split,
    "slabs in parts of 192 cells": parted(192),
    "slabs in parts of 288 cells": parted(288),
    "reach times velocity kept": kept_products,
}


def system_of(dx_mm: float, precision: str) -> System:
    numerics = {"dx_mm": dx_mm, "precision": precision}
    grasp = {"seed": 3, "force_n": 8}
    scene = {"object": "cube_20p7", "grasp": grasp, "numerics": numerics}
    return build_plan(Scene.model_validate(scene)).system


def compared(dx_mm: float, steps: int, repeats: int) -> list[tuple[str, float, float, float]]:
    """Name, µs a sweep, time over today's and error of the field of each variant."""
    system, exact = system_of(dx_mm, "float32"), system_of(dx_mm, "float64")
    start = np.random.default_rng(0).uniform(-1, 1, system.mass.size) * (system.mass.ravel() > 0)
    truth = today(exact, start)(steps).copy()
    runs = {name: make(system, start.astype(np.float32)) for name, make in VARIANTS.items()}
    error = {
        name: float(np.linalg.norm(made(steps) - truth) / np.linalg.norm(truth))
        for name, made in runs.items()
    }
    seconds: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(repeats):
        for name, made in runs.items():
            begin = process_time()
            made(steps)
            seconds[name].append(process_time() - begin)
    ratios = {n: np.median(np.divide(t, seconds["today"])) for n, t in seconds.items()}
    return [(n, min(t) / steps * 1e6, float(ratios[n]), error[n]) for n, t in seconds.items()]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dx", type=float, default=4.2, help="grid spacing in mm")
    parser.add_argument("--steps", type=int, default=400)
    parser.add_argument("--repeats", type=int, default=25)
    arguments = parser.parse_args()
    print("| variant | µs a sweep | time / today | error of the field |")
    print("| --- | --- | --- | --- |")
    for name, micros, ratio, error in compared(arguments.dx, arguments.steps, arguments.repeats):
        print(f"| {name} | {micros:.1f} | {ratio:.2f} | {error:.1e} |")


if __name__ == "__main__":
    main()
