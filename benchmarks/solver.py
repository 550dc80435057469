"""Compare the speed of the wave kernel with the same scheme in C and Devito.

Run `python benchmarks/solver.py` (`--dx 2.5` for another grid). All programs simulate the lossless
cavity of one grasp, with its cut cells, from the same random pressures in float32, on one core.
Their final pressures must agree. C needs a compiler (`cc`), and Devito needs `pip install devito`.
The output lists programs that are not installed.

A rate is the number of updated open cells per second. Runs are interleaved, and the shortest CPU
time of each program counts, so other processes on the computer have little influence.

The bound is the rate of a loop that reads and writes the same arrays, cell by cell, without the
neighbours of a cell: with the arrays of this grid (in cache), and with large arrays (in memory).
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
from solver_peers import AJGDATA, Problem, Route, disagreement, problem, routes

from ajgdata.gripper.system import aligned

#: Largest relative difference between programs. The rounding error of float32 grows with the square
#: root of the number of steps; the difference of a wrong scheme is about 1.
AGREE = 1e-4
#: Number of cells whose arrays are much larger than the cache.
MEMORY_CELLS = 24_000_000


def best_times(programs: dict[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    """Return the shortest CPU time of each program in seconds, from interleaved runs."""
    seconds = dict.fromkeys(programs, np.inf)
    for _ in range(repeats):
        for name, run in programs.items():
            start = process_time()
            run()
            seconds[name] = min(seconds[name], process_time() - start)
    return seconds


@njit(nogil=True, cache=True)
def stream(p, ux, uy, uz, gx, gy, gz, yield_, rx, ry, rz, repeats):
    """Read 11 arrays and write 4, as the kernel does in air, without the neighbours of a cell."""
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
    """Return a run of `stream` on new arrays of `cells` cells."""
    arrays = [aligned(cells, np.float32) for _ in range(11)]
    for array in arrays:
        array[:] = 1e-3
    stream(*arrays, 1)  # compiles the loop, and allocates the memory
    return functools.partial(stream, *arrays, repeats)


def bounds(cavity: Problem) -> dict[str, tuple[Callable[[], object], int]]:
    """Return the run of each bound, and the number of cells that it updates."""
    return {
        "bound: stream in cache": (streamed(cavity.cells, 500), cavity.cells * 500),
        "bound: stream in memory": (streamed(MEMORY_CELLS, 1), MEMORY_CELLS),
    }


def rates(cavity: Problem, programs: dict[str, Route], steps: int, repeats: int) -> Table:
    """Return a table with the cell updates per second of each program and of the bounds."""
    limits = bounds(cavity)
    runs: dict[str, Callable[[], object]] = {}
    updates = {}  # number of updated cells of a run
    for name, route in programs.items():
        runs[name] = functools.partial(route, steps)
        updates[name] = cavity.cells * steps
    for name, (run, cells) in limits.items():
        runs[name] = run
        updates[name] = cells
    seconds = best_times(runs, repeats)
    own_rate = updates[AJGDATA] / seconds[AJGDATA]
    table = Table(title="cell updates")
    table.add_column("", no_wrap=True)
    for heading in ("Mcell/s", "time / ajgdata", "ajgdata / bound"):
        table.add_column(heading, justify="right", no_wrap=True)
    for name, count in updates.items():
        rate = count / seconds[name]
        time_ratio = "" if name in limits else f"{own_rate / rate:.2f}"
        share_of_bound = f"{own_rate / rate:.0%}" if name in limits else ""
        table.add_row(name, f"{rate / 1e6:,.0f}", time_ratio, share_of_bound)
    return table


def main() -> None:
    """Check that the programs agree, and print their rates."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dx", type=float, default=4.0, help="grid spacing in mm")
    parser.add_argument("--steps", type=int, default=500)
    parser.add_argument("--repeats", type=int, default=5)
    arguments = parser.parse_args()
    console = Console(width=100)
    cavity = problem(arguments.dx)
    programs, missing = routes(cavity)
    for name, difference in disagreement(programs, arguments.steps).items():
        if difference > AGREE:
            raise SystemExit(f"{name} differs by {difference:.1e} of the largest pressure")
    span = cavity.system.span
    console.print(
        f"{arguments.dx:g} mm: {cavity.cells:,} open cells of "
        f"{cavity.start.size:,} (ajgdata visits {int((span.hi - span.lo).sum()):,}), "
        f"{arguments.steps} steps, best of {arguments.repeats}, one core, load "
        f"{os.getloadavg()[0]:.1f}; all pressures agree within {AGREE:g}"
    )
    console.print(rates(cavity, programs, arguments.steps, arguments.repeats))
    for line in missing:
        console.print(f"skipped: {line}")


if __name__ == "__main__":
    main()
