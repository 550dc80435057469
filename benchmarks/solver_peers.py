"""The programs that benchmarks/solver.py compares: one wave scheme on one grid."""

from __future__ import annotations

import ctypes
import importlib.util
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper import Scene, build_plan
from ajgdata.gripper.medium import Air, air_fluid
from ajgdata.gripper.solver import Probe, at_rest, march
from ajgdata.gripper.solver_plan import wide_weight
from ajgdata.gripper.system import System, assemble

Real = NDArray[np.floating]
#: A program: returns the pressures (nz, ny, nx) after a number of steps from the start.
Route = Callable[[int], Real]
#: Name of the program of this package, which is the first.
AJGDATA = "ajgdata (numba)"
#: A source and a receiver without effect.
SILENT = Probe(np.zeros(1, np.uint64), np.zeros(1))
#: Flags of the C compiler.
FLAGS = ("-O3", "-march=native", "-ffp-contract=off", "-shared", "-fPIC")


@dataclass(frozen=True)
class Problem:
    """A lossless cavity: system, initial pressures and coefficients (nz, ny, nx), float32."""

    system: System
    start: Real
    gains: tuple[Real, Real, Real]
    reach: tuple[Real, ...]
    yield_: Real

    @property
    def cells(self) -> int:
        """The number of open cells."""
        return int(np.count_nonzero(self.system.mass))


def problem(dx_mm: float) -> Problem:
    """Return the cavity of the default gripper on a 20 mm cube, with air and rigid walls."""
    spec = {"object": {"kind": "cube", "edge_mm": 20}, "numerics": {"dx_mm": dx_mm}}
    plan = build_plan(Scene.model_validate(spec))
    air = air_fluid(Air(22.0))
    dt = plan.system.dt
    system = assemble(plan.cells, air, dt, dtype=np.float32, wide=wide_weight(plan.cells.h))
    live = system.mass > 0
    # Noise instead of a pulse: the edge of a pulse has denormal numbers, which are slow.
    noise = np.random.default_rng(0).uniform(-1, 1, system.shape).astype(np.float32)
    faces = system.faces
    gx, gy, gz = (g.reshape(system.shape) for g in (faces.gain_x, faces.gain_y, faces.gain_z))
    reach = tuple(r.reshape(system.shape) for r in system.reach)
    yield_ = system.capacities.yield_.reshape(system.shape)
    return Problem(system, noise * live, (gx, gy, gz), reach, yield_)


def by_ajgdata(cavity: Problem) -> Route:
    """Return the program of this package."""

    def run(steps: int) -> Real:
        state = at_rest(cavity.system)
        state.p[:] = cavity.start.ravel()
        march(cavity.system, state, SILENT, SILENT, np.zeros(0), steps)
        return state.p.reshape(cavity.system.shape)

    return run


def by_c(cavity: Problem) -> Route:
    """Return the program of benchmarks/solver.c, compiled for this computer.

    It has the same slabs, spans and arrays as the kernel of this package.
    """
    source = Path(__file__).with_name("solver.c")
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "solver.so"
        subprocess.run(["cc", *FLAGS, "-o", str(library), str(source)], check=True)
        loaded = ctypes.CDLL(str(library))
    kernel = loaded.march
    span = cavity.system.span
    bounds = [np.ascontiguousarray(b, dtype=np.uintp) for b in (span.lo, span.hi)]
    fixed = [np.ascontiguousarray(a) for a in (*cavity.gains, cavity.yield_, *cavity.reach)]

    def run(steps: int) -> Real:
        moving = at_rest(cavity.system)[:4]
        moving[0][:] = cavity.start.ravel()
        arrays = [ctypes.c_void_p(a.ctypes.data) for a in (*moving, *fixed, *bounds)]
        counts = (len(span.lo), span.row, span.slab, steps)
        kernel(*arrays, *(ctypes.c_size_t(int(n)) for n in counts))
        return moving[0].reshape(cavity.start.shape)

    return run


def by_devito(cavity: Problem) -> Route:
    """Return the program of Devito.

    It follows the manual for first-order systems: each field has two time levels, and one operator
    updates all fields.
    """
    import devito

    devito.configuration["log-level"] = "ERROR"
    grid = devito.Grid(cavity.start.shape, dtype=np.float32)
    z, y, x = grid.dimensions
    p, ux, uy, uz = (
        devito.TimeFunction(name=name, grid=grid, time_order=1, space_order=4)
        for name in ("p", "ux", "uy", "uz")
    )
    fixed = []
    for number, values in enumerate((cavity.yield_, *cavity.gains, *cavity.reach)):
        fixed.append(devito.Function(name=f"f{number}", grid=grid, space_order=4))
        fixed[-1].data[:] = values
    yield_ = fixed[0]
    gains = fixed[1:4]
    reach = fixed[4:]

    def at(field: Any, along: Any, cells: int) -> Any:
        return field.subs({along: along + cells * along.spacing})

    moves = []
    out = 0
    for u, gain, far, along in zip((ux, uy, uz), gains, reach, (x, y, z), strict=True):
        rise = at(p, along, 1) - p - far * (at(p, along, 2) - at(p, along, -1))
        moves.append(devito.Eq(u.forward, u - gain * rise))
        new = u.forward
        out += new - at(new, along, -1)
        out -= at(far, along, 1) * at(new, along, 1) - at(far, along, -2) * at(new, along, -2)
    operator = devito.Operator([*moves, devito.Eq(p.forward, p - yield_ * out)])

    def run(steps: int) -> Real:
        for field in (ux, uy, uz):
            field.data.fill(0)
        p.data[0] = cavity.start
        operator(time_m=0, time_M=steps - 1)
        return np.array(p.data[steps % 2])

    return run


def routes(cavity: Problem) -> tuple[dict[str, Route], list[str]]:
    """Return the installed programs by name, and one line per program that is not installed."""
    programs = {AJGDATA: by_ajgdata(cavity)}
    missing = []
    if shutil.which("cc"):
        programs[f"C (cc {' '.join(FLAGS[:2])})"] = by_c(cavity)
    else:
        missing.append("C: no compiler (cc) here")
    if importlib.util.find_spec("devito"):
        programs["Devito"] = by_devito(cavity)
    else:
        missing.append("Devito: not installed (pip install devito)")
    return programs, missing


def disagreement(programs: dict[str, Route], steps: int) -> dict[str, float]:
    """Return the largest difference of each program's pressures from those of the first program.

    The difference is relative to the largest pressure of the first program.
    """
    results = {name: route(steps) for name, route in programs.items()}
    first = next(iter(results.values()))
    return {
        name: float(np.abs(pressure - first).max() / np.abs(first).max())
        for name, pressure in results.items()
    }
