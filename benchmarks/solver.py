"""The wave kernel beside the same scheme in C and Devito: one grid, same steps.

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
import functools
import os
from collections.abc import Callable
from time import process_time

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np
from numba import njit
from rich.console import Console
from rich.table import Table
from solver_peers import Problem, Route, disagreement, problem, routes

from ajgdata.gripper.system import aligned

#: Rounding of float32 grows with the root of the steps; a wrong scheme is off by 1.
AGREE = 1e-4
MEMORY_CELLS = 24_000_000


def best_times(programs: dict[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    """Smallest process time of each, interleaved."""
    seconds = dict.fromkeys(programs, np.inf)
    for _ in range(repeats):
        for name, run in programs.items():
            begun = process_time()
            run()
            seconds[name] = min(seconds[name], process_time() - begun)
    return seconds


@njit(nogil=True, cache=True)
def stream(p, ux, uy, uz, gx, gy, gz, yield_, rx, ry, rz, repeats):
    """Reads 11 arrays and writes 4, as the kernel does in air; looks at no neighbour."""
    for _ in range(repeats):
        for i in range(len(p)):
            a = ux[i] - gx[i] * (rx[i] * p[i])
            b = uy[i] - gy[i] * (ry[i] * p[i])
            c = uz[i] - gz[i] * (rz[i] * p[i])
            ux[i] = a
            uy[i] = b
            uz[i] = c
            p[i] -= yield_[i] * (a + b + c)


def streamed(cells: int, repeats: int) -> Callable[[], object]:
    arrays = [aligned(cells, np.float32) for _ in range(11)]
    for array in arrays:
        array[:] = 1e-3
    stream(*arrays, 1)  # compile it, and touch the memory
    return functools.partial(stream, *arrays, repeats)


def bounds(given: Problem) -> dict[str, tuple[Callable[[], object], int]]:
    """Streams with the cells they update: in cache, and in memory."""
    return {
        "bound: stream in cache": (streamed(given.cells, 500), given.cells * 500),
        "bound: stream in memory": (streamed(MEMORY_CELLS, 1), MEMORY_CELLS),
    }


def report(given: Problem, programs: dict[str, Route], steps: int, repeats: int) -> Table:
    """Cell updates per second of each route and of the bounds."""
    limits = bounds(given)
    runs: dict[str, Callable[[], object]] = {
        **{name: functools.partial(route, steps) for name, route in programs.items()},
        **{name: stream for name, (stream, _) in limits.items()},
    }
    seconds = best_times(runs, repeats)
    rate = {name: given.cells * steps / seconds[name] for name in programs}
    rate |= {name: cells / seconds[name] for name, (_, cells) in limits.items()}
    ours = next(iter(rate.values()))
    table = Table(title="cell updates")
    for heading in ("", "Mcell/s", "time / ours", "ours / bound"):
        table.add_column(heading, justify="right" if heading else "left", no_wrap=True)
    for name, cells in rate.items():
        cell = ("", f"{ours / cells:.0%}") if name in limits else (f"{ours / cells:.2f}", "")
        table.add_row(name, f"{cells / 1e6:,.0f}", *cell)
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dx", type=float, default=4.0, help="grid spacing in mm")
    parser.add_argument("--steps", type=int, default=500)
    parser.add_argument("--repeats", type=int, default=5)
    arguments = parser.parse_args()
    console = Console(width=100)
    given = problem(arguments.dx)
    programs, missing = routes(given)
    for name, difference in disagreement(programs, arguments.steps).items():
        if difference > AGREE:
            raise SystemExit(f"{name} differs by {difference:.1e} of the largest pressure")
    span = given.system.span
    console.print(
        f"{arguments.dx:g} mm: {given.cells:,} open cells of "
        f"{given.start.size:,} (ours visits {int((span.hi - span.lo).sum()):,}), "
        f"{arguments.steps} steps, best of {arguments.repeats}, one core, load "
        f"{os.getloadavg()[0]:.1f}; all pressures agree within {AGREE:g}"
    )
    console.print(report(given, programs, arguments.steps, arguments.repeats))
    for line in missing:
        console.print(f"left out: {line}")


if __name__ == "__main__":
    main()
