"""The wave kernel beside the same scheme in C, Devito, numpy and torch: one grid, same steps.

Run `python benchmarks/solver.py` (`--dx 2.5` for another grid). All march the lossless cavity of
one grasp, with its cut cells, from the same random pressures in float32, on one core; their final
pressures must agree. C needs a compiler (`cc`), Devito needs Devito (`pip install devito`); what is
missing is said and left out. Rates count open cells. Runs are interleaved and the best of each
counts, in time of the process, so that a busy machine disturbs all alike and little.

The bound is the rate of a loop that reads and writes the same arrays, cell by cell, and looks at no
neighbour: in cache as on this grid, and in memory.
"""

from __future__ import annotations

import argparse
import ctypes
import functools
import importlib.util
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import process_time

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np
from numba import njit
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from ajgdata.gripper import Scene, compile
from ajgdata.gripper.medium import Air, air_fluid
from ajgdata.gripper.solver import Probe, at_rest, march
from ajgdata.gripper.system import System, assemble

Real = NDArray[np.floating]
#: Steps -> pressures (nz, ny, nx) after as many steps from the start.
Route = Callable[[int], Real]
SILENT = Probe(np.zeros(1, np.uint64), np.zeros(1))
FLAGS = ("-O3", "-march=native", "-ffp-contract=off", "-shared", "-fPIC")
#: Rounding of float32 grows with the root of the steps; a wrong scheme is off by 1.
AGREE = 1e-4
MEMORY_CELLS = 24_000_000


@dataclass(frozen=True)
class Problem:
    """The lossless cavity: its system, first pressures and coefficients (nz, ny, nx) float32."""

    system: System
    start: Real
    gains: tuple[Real, Real, Real]
    yield_: Real

    @property
    def cells(self) -> int:
        """Open cells."""
        return int(np.count_nonzero(self.system.mass))


def problem(dx_mm: float) -> Problem:
    """A 20 mm cube in the default gripper, filled with nothing but air, all walls rigid."""
    spec = {"object": {"kind": "cube", "edge_mm": 20}, "numerics": {"dx_mm": dx_mm}}
    plan = compile(Scene.model_validate(spec))
    system = assemble(plan.cells, air_fluid(Air(22.0)), plan.system.dt, dtype=np.float32)
    live = system.mass > 0
    # Not a pulse: its edge would be denormal numbers, which are slow.
    noise = np.random.default_rng(0).uniform(-1, 1, system.shape).astype(np.float32)
    faces = system.faces
    gx, gy, gz = (g.reshape(system.shape) for g in (faces.gain_x, faces.gain_y, faces.gain_z))
    return Problem(
        system, noise * live, (gx, gy, gz), system.capacities.yield_.reshape(system.shape)
    )


def ours(given: Problem) -> Route:
    def run(steps: int) -> Real:
        state = at_rest(given.system)
        state.p[:] = given.start.ravel()
        march(given.system, state, SILENT, SILENT, np.zeros(0), steps)
        return state.p.reshape(given.system.shape)

    return run


def by_c(given: Problem) -> Route:
    """benchmarks/solver.c, compiled for this machine; the same slabs and spans as ours."""
    source = Path(__file__).with_suffix(".c")
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "solver.so"
        subprocess.run(["cc", *FLAGS, "-o", str(library), str(source)], check=True)
        kernel = ctypes.CDLL(str(library)).march_air
    span = given.system.span
    bounds = [np.ascontiguousarray(b, dtype=np.uintp) for b in (span.lo, span.hi)]
    fixed = [np.ascontiguousarray(a) for a in (*given.gains, given.yield_)]

    def run(steps: int) -> Real:
        moving = [given.start.copy(), *(np.zeros_like(given.start) for _ in range(3))]
        arrays = [ctypes.c_void_p(a.ctypes.data) for a in (*moving, *fixed, *bounds)]
        counts = (len(span.lo), span.row, span.slab, steps)
        kernel(*arrays, *(ctypes.c_size_t(int(n)) for n in counts))
        return moving[0]

    return run


def by_devito(given: Problem) -> Route:
    """As its manual writes a first-order system: each field at two times, one operator."""
    import devito

    devito.configuration["log-level"] = "ERROR"
    grid = devito.Grid(given.start.shape, dtype=np.float32)
    z, y, x = grid.dimensions
    p, ux, uy, uz = (
        devito.TimeFunction(name=name, grid=grid, time_order=1, space_order=2)
        for name in ("p", "ux", "uy", "uz")
    )
    names = ("gx", "gy", "gz", "yield_")
    fixed = [devito.Function(name=name, grid=grid, space_order=2) for name in names]
    for function, values in zip(fixed, (*given.gains, given.yield_), strict=True):
        function.data[:] = values
    gx, gy, gz, yield_ = fixed

    def after(field: object, along: object) -> object:
        return field.subs({along: along + along.spacing})  # type: ignore[attr-defined]

    def before(field: object, along: object) -> object:
        return field.subs({along: along - along.spacing})  # type: ignore[attr-defined]

    new = [field.forward for field in (ux, uy, uz)]
    axes = (x, y, z)
    moves = [
        devito.Eq(u.forward, u - g * (after(p, along) - p))
        for u, g, along in zip((ux, uy, uz), (gx, gy, gz), axes, strict=True)
    ]
    out = sum(u - before(u, along) for u, along in zip(new, axes, strict=True))
    operator = devito.Operator([*moves, devito.Eq(p.forward, p - yield_ * out)])

    def run(steps: int) -> Real:
        for field in (ux, uy, uz):
            field.data.fill(0)
        p.data[0] = given.start
        operator(time_m=0, time_M=steps - 1)
        return np.array(p.data[steps % 2])

    return run


def by_numpy(given: Problem) -> Route:
    """Slices, without temporary arrays."""
    gx, gy, gz = given.gains

    def run(steps: int) -> Real:
        p = given.start.copy()
        ux, uy, uz, work = (np.zeros_like(p) for _ in range(4))
        for _ in range(steps):
            for u, gain, axis in ((ux, gx, 2), (uy, gy, 1), (uz, gz, 0)):
                low, high = halves(axis)
                np.subtract(p[high], p[low], out=work[low])
                np.multiply(work[low], gain[low], out=work[low])
                np.subtract(u[low], work[low], out=u[low])
            np.add(ux, uy, out=work)
            np.add(work, uz, out=work)
            for u, axis in ((ux, 2), (uy, 1), (uz, 0)):
                low, high = halves(axis)
                np.subtract(work[high], u[low], out=work[high])
            np.multiply(work, given.yield_, out=work)
            np.subtract(p, work, out=p)
        return p

    return run


def halves(axis: int) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
    """All but the last, and all but the first, along one axis of three."""
    low, high = [slice(None)] * 3, [slice(None)] * 3
    low[axis], high[axis] = slice(None, -1), slice(1, None)
    return tuple(low), tuple(high)


def by_torch_slices(given: Problem) -> Route:
    import torch

    torch.set_num_threads(1)
    gx, gy, gz, yield_ = (torch.from_numpy(a.copy()) for a in (*given.gains, given.yield_))

    def run(steps: int) -> Real:
        p = torch.from_numpy(given.start.copy())
        ux, uy, uz = (torch.zeros_like(p) for _ in range(3))
        with torch.no_grad():
            for _ in range(steps):
                for u, gain, axis in ((ux, gx, 2), (uy, gy, 1), (uz, gz, 0)):
                    low, high = halves(axis)
                    u[low].addcmul_(gain[low], p[high] - p[low], value=-1)
                out = ux + uy
                out += uz
                for u, axis in ((ux, 2), (uy, 1), (uz, 0)):
                    low, high = halves(axis)
                    out[high] -= u[low]
                p.addcmul_(yield_, out, value=-1)
        return p.numpy()

    return run


def by_torch_conv3d(given: Problem) -> Route:
    """Gradient and divergence as convolutions, as networks for wave equations are written."""
    import torch
    from torch.nn.functional import conv3d, pad

    torch.set_num_threads(1)
    gains = torch.from_numpy(np.stack(given.gains))[None]
    yield_ = torch.from_numpy(given.yield_.copy())[None, None]
    gradient, divergence = torch.zeros(3, 1, 2, 2, 2), torch.zeros(1, 3, 2, 2, 2)
    for axis, (z, y, x) in enumerate(((0, 0, 1), (0, 1, 0), (1, 0, 0))):
        gradient[axis, 0, 0, 0, 0], gradient[axis, 0, z, y, x] = -1, 1
        divergence[0, axis, 1, 1, 1], divergence[0, axis, 1 - z, 1 - y, 1 - x] = 1, -1

    def run(steps: int) -> Real:
        p = torch.from_numpy(given.start.copy())[None, None]
        u = torch.zeros_like(gains)
        with torch.no_grad():
            for _ in range(steps):
                u.addcmul_(gains, conv3d(pad(p, (0, 1, 0, 1, 0, 1)), gradient), value=-1)
                p.addcmul_(yield_, conv3d(pad(u, (1, 0, 1, 0, 1, 0)), divergence), value=-1)
        return p[0, 0].numpy()

    return run


def routes(given: Problem) -> tuple[dict[str, Route], list[str]]:
    """What can run here, and what cannot and why."""
    made, missing = {"ours (numba)": ours(given)}, []
    if shutil.which("cc"):
        made[f"C (cc {' '.join(FLAGS[:2])})"] = by_c(given)
    else:
        missing.append("C: no compiler (cc) here")
    if importlib.util.find_spec("devito"):
        made["Devito"] = by_devito(given)
    else:
        missing.append("Devito: not installed (pip install devito)")
    made["numpy slices"] = by_numpy(given)
    made["torch slices"] = by_torch_slices(given)
    made["torch conv3d"] = by_torch_conv3d(given)
    return made, missing


def disagreement(made: dict[str, Route], steps: int) -> dict[str, float]:
    """Largest difference of each route's pressures from the first's, of their largest."""
    results = {name: route(steps) for name, route in made.items()}
    first = next(iter(results.values()))
    return {
        name: float(np.abs(found - first).max() / np.abs(first).max())
        for name, found in results.items()
    }


def best_times(made: dict[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    """Smallest process time of each, interleaved."""
    seconds = dict.fromkeys(made, np.inf)
    for _ in range(repeats):
        for name, run in made.items():
            begun = process_time()
            run()
            seconds[name] = min(seconds[name], process_time() - begun)
    return seconds


@njit(nogil=True, cache=True)
def stream(p, ux, uy, uz, gx, gy, gz, yield_, repeats):
    """Reads 8 arrays and writes 4, as the kernel in air does, and looks at no neighbour."""
    for _ in range(repeats):
        for i in range(len(p)):
            a = ux[i] - gx[i] * p[i]
            b = uy[i] - gy[i] * p[i]
            c = uz[i] - gz[i] * p[i]
            ux[i], uy[i], uz[i] = a, b, c
            p[i] -= yield_[i] * (a + b + c)


def streamed(cells: int, repeats: int) -> Callable[[], object]:
    arrays = [np.full(cells, 1e-3, np.float32) for _ in range(8)]
    stream(*arrays, 1)  # compile it, and touch the memory
    return functools.partial(stream, *arrays, repeats)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dx", type=float, default=4.0, help="grid spacing in mm")
    parser.add_argument("--steps", type=int, default=500)
    parser.add_argument("--repeats", type=int, default=5)
    arguments = parser.parse_args()
    console = Console(width=100)
    given = problem(arguments.dx)
    made, missing = routes(given)
    for name, difference in disagreement(made, arguments.steps).items():
        if difference > AGREE:
            raise SystemExit(f"{name} differs by {difference:.1e} of the largest pressure")
    span = given.system.span
    console.print(
        f"{arguments.dx:g} mm: {given.cells:,} open cells of {given.start.size:,} (ours visits "
        f"{int((span.hi - span.lo).sum()):,}), "
        f"{arguments.steps} steps, best of {arguments.repeats}, one core, load "
        f"{os.getloadavg()[0]:.1f}; all pressures agree within {AGREE:g}"
    )
    runs: dict[str, Callable[[], object]] = {
        name: functools.partial(route, arguments.steps) for name, route in made.items()
    }
    work = dict.fromkeys(runs, given.cells * arguments.steps)
    cached, memory = "bound: stream in cache", "bound: stream in memory"
    runs[cached], work[cached] = streamed(given.cells, 500), given.cells * 500
    runs[memory], work[memory] = streamed(MEMORY_CELLS, 1), MEMORY_CELLS
    seconds = best_times(runs, arguments.repeats)
    rate = {name: work[name] / seconds[name] for name in runs}
    mine = next(iter(rate.values()))
    table = Table(title="cell updates")
    for heading in ("", "Mcell/s", "time / ours", "ours / bound"):
        table.add_column(heading, justify="right" if heading else "left", no_wrap=True)
    for name in runs:
        is_bound = name in (cached, memory)
        ratio, share = f"{mine / rate[name]:.2f}", f"{mine / rate[name]:.0%}"
        table.add_row(
            name, f"{rate[name] / 1e6:,.0f}", "" if is_bound else ratio, share if is_bound else ""
        )
    console.print(table)
    for line in missing:
        console.print(f"left out: {line}")


if __name__ == "__main__":
    main()
