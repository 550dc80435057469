"""Variants of the wide kernel, on the grid of one grasp: time of a sweep and error of the field.

Run `python benchmarks/kernel.py`; it prints the table of docs/virtual-gripper.md. All march the
same scene from the same random pressures on one core, without walls and modes, interleaved. Time is
that of the process, the least of all and the median of the ratios to today's kernel; the error is
that of the pressure after as many steps, relative to the same march in float64 (L2). The last lines
are a loop that reads and writes as many arrays and looks at no neighbour, for one scene and for
sixteen at once, as if these lay side by side in the lanes of a vector.
"""

from __future__ import annotations

import argparse
import functools
import os
from collections.abc import Callable, Mapping
from time import process_time
from typing import Any

os.environ["OMP_NUM_THREADS"] = "1"

import numpy as np
from numba import float32, njit, uint64
from numpy.typing import NDArray
from solver import wide_stream

from ajgdata.gripper import Scene, build_plan
from ajgdata.gripper.solver import _empty, _relax, _wide_sweep, at_rest
from ajgdata.gripper.system import System, aligned

#: Marches `steps` from the start and returns the pressure (cells,).
Run = Callable[[int], NDArray]
SCENES = 16
ARRAYS = 11


@njit(nogil=True)
def marched(steps, state, faces, reach, unit, capacities, span, scratch):
    for _ in range(steps):
        _wide_sweep(state, faces, reach, capacities, span, scratch)


@njit(nogil=True)
def velocity(u, decay, gain, reach, unit, p, lo, hi, step):
    for i in range(lo, hi):
        rise = (p[i + step] - p[i]) - reach[i] * (p[i + step + step] - p[i - step])
        u[i] = decay[i] * u[i] - gain[i] * rise


@njit(nogil=True)
def byte_velocity(u, decay, gain, reach, unit, p, lo, hi, step):
    for i in range(lo, hi):
        far = unit * float32(reach[i]) * (p[i + step + step] - p[i - step])
        u[i] = decay[i] * u[i] - gain[i] * ((p[i + step] - p[i]) - far)


@njit(nogil=True)
def short_velocity(u, decay, gain, reach, unit, p, lo, hi, step):
    full = float32(1 / 65535)
    for i in range(lo, hi):
        rise = (p[i + step] - p[i]) - reach[i] * (p[i + step + step] - p[i - step])
        u[i] = full * float32(decay[i]) * u[i] - unit * float32(gain[i]) * rise


@njit(nogil=True)
def divergence(into, ux, uy, uz, rx, ry, rz, unit, lo, hi, row, slab):
    one = uint64(1)
    two, rows, slabs = one + one, row + row, slab + slab
    for i in range(lo, hi):
        out = (ux[i] - ux[i - one]) + (uy[i] - uy[i - row]) + (uz[i] - uz[i - slab])
        x = rx[i + one] * ux[i + one] - rx[i - two] * ux[i - two]
        y = ry[i + row] * uy[i + row] - ry[i - rows] * uy[i - rows]
        z = rz[i + slab] * uz[i + slab] - rz[i - slabs] * uz[i - slabs]
        into[i - lo] = out - (x + y + z)


@njit(nogil=True)
def byte_divergence(into, ux, uy, uz, rx, ry, rz, unit, lo, hi, row, slab):
    one = uint64(1)
    two, rows, slabs = one + one, row + row, slab + slab
    for i in range(lo, hi):
        out = (ux[i] - ux[i - one]) + (uy[i] - uy[i - row]) + (uz[i] - uz[i - slab])
        x = float32(rx[i + one]) * ux[i + one] - float32(rx[i - two]) * ux[i - two]
        y = float32(ry[i + row]) * uy[i + row] - float32(ry[i - rows]) * uy[i - rows]
        z = float32(rz[i + slab]) * uz[i + slab] - float32(rz[i - slabs]) * uz[i - slabs]
        into[i - lo] = out - unit * (x + y + z)


def kernel(push: Any, spread: Any, ahead: bool = False) -> Any:
    """Return a march with other loops; velocities along x and y a slab `ahead`, as that along z
    must be."""

    @njit(nogil=True)
    def march(steps, state, faces, reach, unit, capacities, span, scratch):
        p, ux, uy, uz, r1, r2 = state[:6]
        decay_x, decay_y, decay_z, gain_x, gain_y, gain_z = faces
        rx, ry, rz = reach
        first, last, bed, row, slab = span
        for _ in range(steps):
            for k in range(len(first) - 1):
                push(uz, decay_z, gain_z, rz, unit, p, first[k + 1], last[k + 1], slab)
                lo, hi = first[k + ahead], last[k + ahead]
                push(ux, decay_x, gain_x, rx, unit, p, lo, hi, uint64(1))
                push(uy, decay_y, gain_y, ry, unit, p, lo, hi, row)
                lo, hi = first[k], last[k]
                spread(scratch, ux, uy, uz, rx, ry, rz, unit, lo, hi, row, slab)
                if k < bed:
                    _relax(p, r1, r2, capacities, scratch, lo, hi)
                else:
                    _empty(p, capacities[1], capacities[0], scratch, lo, hi)

    return march


@njit(nogil=True)
def parted(steps, state, faces, reach, unit, capacities, span, scratch):
    """Half slabs: what one loop leaves in the first-level cache the next one finds there."""
    p, ux, uy, uz, r1, r2 = state[:6]
    decay_x, decay_y, decay_z, gain_x, gain_y, gain_z = faces
    rx, ry, rz = reach
    first, last, bed, row, slab = span
    part = slab // uint64(2)
    for _ in range(steps):
        for k in range(len(first) - 1):
            begin, end, done, top = first[k + 1], last[k + 1], first[k], last[k]
            while begin < end or done < top:
                lo, hi = begin, min(begin + part, end)
                velocity(ux, decay_x, gain_x, rx, unit, p, lo, hi, uint64(1))
                velocity(uy, decay_y, gain_y, ry, unit, p, lo, hi, row)
                velocity(uz, decay_z, gain_z, rz, unit, p, lo, hi, slab)
                begin = hi
                # Below, only what no velocity still to come reads: all of it at the end.
                lo, hi = done, top if begin >= end else max(done, min(begin - slab, top))
                divergence(scratch, ux, uy, uz, rx, ry, rz, unit, lo, hi, row, slab)
                if k < bed:
                    _relax(p, r1, r2, capacities, scratch, lo, hi)
                else:
                    _empty(p, capacities[1], capacities[0], scratch, lo, hi)
                done = hi


def prepared(
    system: System, start: NDArray, march: Any, byte: bool = False, short: bool = False
) -> Run:
    """Return a march of `system`; reach as bytes, decay and gain as 16 bits, in units of the
    largest. A face and its adjoint read the same, so that energy is conserved all the same."""
    state, span, unit = at_rest(system), system.span, 1.0
    faces, reach = tuple(system.faces), tuple(system.reach)
    if byte:
        unit = max(float(one.max()) for one in reach) / 255
        reach = tuple(whole(one / unit, np.uint8) for one in reach)
    if short:
        unit = max(float(one.max()) for one in faces[3:]) / 65535
        units = [1 / 65535] * 3 + [unit] * 3
        faces = tuple(whole(f / one, np.uint16) for f, one in zip(faces, units, strict=True))
    numbers = (np.uint64(n) for n in (span.bed_slabs, span.row, span.slab))
    spans = (span.lo, span.hi, *numbers)
    given = (faces, reach, np.float32(unit), tuple(system.capacities), spans)
    scratch = aligned(span.slab, start.dtype)

    def run(steps: int) -> NDArray:
        for array in state:
            array[...] = 0
        state.p[:] = start
        march(steps, tuple(state), *given, scratch)
        return state.p

    return run


def whole(values: NDArray, dtype: Any) -> NDArray:
    out = aligned(values.size, dtype)
    out[:] = np.round(values)
    return out


VARIANTS: Mapping[str, Callable[[System, NDArray], Run]] = {
    "today": functools.partial(prepared, march=marched),
    "the same loops, with drag in the air, too": functools.partial(
        prepared, march=kernel(velocity, divergence)
    ),
    "these, velocities along x and y a slab ahead": functools.partial(
        prepared, march=kernel(velocity, divergence, ahead=True)
    ),
    "these, in half slabs": functools.partial(prepared, march=parted),
    "these, reach as one byte": functools.partial(
        prepared, march=kernel(byte_velocity, byte_divergence), byte=True
    ),
    "these, drag and gain as 16 bits": functools.partial(
        prepared, march=kernel(short_velocity, divergence), short=True
    ),
}


def system_of(dx_mm: float, precision: str) -> System:
    numerics = {"dx_mm": dx_mm, "precision": precision}
    grasp = {"seed": 3, "force_n": 8}
    scene = {"object": "cube_20p7", "grasp": grasp, "numerics": numerics}
    return build_plan(Scene.model_validate(scene)).system


def streamed(cells: int) -> Callable[[int], object]:
    arrays = [aligned(cells, np.float32) for _ in range(ARRAYS)]
    for array in arrays:
        array[:] = 1e-3
    return lambda steps: wide_stream(*arrays, steps)


def compared(
    dx_mm: float, steps: int, repeats: int
) -> list[tuple[str, float, float, float | None]]:
    """Name, µs a sweep of one scene, time over today's and error of the field of each variant."""
    system, exact = system_of(dx_mm, "float32"), system_of(dx_mm, "float64")
    live = system.mass.ravel() > 0
    start = np.random.default_rng(0).uniform(-1, 1, live.size) * live
    truth = prepared(exact, start, marched)(steps)
    runs = {name: make(system, start.astype(np.float32)) for name, make in VARIANTS.items()}
    error = {
        name: float(np.linalg.norm(run(steps) - truth) / np.linalg.norm(truth))
        for name, run in runs.items()
    }
    timed: dict[str, tuple[Callable[[int], object], int]] = {n: (r, 1) for n, r in runs.items()}
    open_cells = int(live.sum())
    timed["a stream of as many arrays"] = streamed(open_cells), 1
    timed[f"such a stream of {SCENES} scenes"] = streamed(SCENES * open_cells), SCENES
    seconds: dict[str, list[float]] = {name: [] for name in timed}
    for run, _ in timed.values():
        run(1)
    for _ in range(repeats):
        for name, (run, scenes) in timed.items():
            begin = process_time()
            run(max(steps // scenes, 1))
            seconds[name].append((process_time() - begin) / max(steps // scenes, 1) / scenes)
    return [
        (n, min(t) * 1e6, float(np.median(np.divide(t, seconds["today"]))), error.get(n))
        for n, t in seconds.items()
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dx", type=float, default=4.2, help="grid spacing in mm")
    parser.add_argument("--steps", type=int, default=400)
    parser.add_argument("--repeats", type=int, default=25)
    arguments = parser.parse_args()
    print("| variant | µs a sweep | of today's time, % | error of the field |")
    print("| --- | --- | --- | --- |")
    for name, micros, ratio, error in compared(arguments.dx, arguments.steps, arguments.repeats):
        said = "—" if error is None else f"{error:.1e}"
        print(f"| {name} | {micros:.1f} | {100 * ratio:.0f} | {said} |")


if __name__ == "__main__":
    main()
