"""Domains, energies and the refinement harness that the wave-solver tests share."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import eigsh

from ajgdata.gripper.grid import Cells, cut_cells
from ajgdata.gripper.medium import Air, Packing, air_fluid, fit_fluid
from ajgdata.gripper.plan import steps_per_sample
from ajgdata.gripper.scene import SAMPLE_RATE_HZ
from ajgdata.gripper.solver import Probe, State, at_rest, march
from ajgdata.gripper.system import Packed, System, assemble
from ajgdata.gripper.walls import NO_WALLS, WallList

AIR = Air(22.0)
PLASTIC = Packing(6e-3, 0.40)


@dataclass(frozen=True)
class Region:
    """Columns from a function of x and y that gives floor, roof and surface."""

    heights: Callable[[np.ndarray, np.ndarray], tuple]

    def at(self, x, y):
        xx, yy = np.meshgrid(x, y)
        floor, roof, surface = (np.broadcast_to(h, xx.shape) * 1.0 for h in self.heights(xx, yy))
        return floor, np.maximum(floor, roof), surface, np.zeros_like(xx)


def box(width: float, depth: float, height: float, bed: float = 0.0) -> Region:
    def heights(x, y):
        inside = (np.abs(x) < width / 2) & (np.abs(y) < depth / 2)
        return 0.0, np.where(inside, height, 0.0), bed

    return Region(heights)


def sphere(radius: float) -> Region:
    def heights(x, y):
        half = np.sqrt(np.clip(radius**2 - x**2 - y**2, 0, None))
        return -half, half, -radius

    return Region(heights)


def bowl() -> Region:
    """Curved, off-grid, half full of grains: every kind of cut cell."""

    def heights(x, y):
        half = np.sqrt(np.clip(0.03**2 - x**2 - y**2, 0, None))
        return -half, half * 0.8 + 0.3 * x * (half > 0), -0.004 + 0.1 * y

    return Region(heights)


def time_step(h: float) -> float:
    return 1 / (SAMPLE_RATE_HZ * steps_per_sample(h, 0.99))


def lossy_bowl(h: float, dtype: type = np.float64) -> System:
    """Grains with varying packing, light, stiff, heavy and resistive walls."""
    cells = cut_cells(bowl(), h, 0.031, -0.031, 0.036)
    ratio = 1 + 0.1 * np.sin(np.arange(np.prod(cells.shape))).reshape(cells.shape)
    walls = (
        WallList.uniform(cells.membrane, 0.3, 450.0, 1e5)
        + WallList.uniform(cells.membrane, 1e-4, 0.0, 1e9)
        + WallList.uniform(cells.housing, 0.0, 2e5, 0.0)
    )
    grains = Packed(fit_fluid(PLASTIC, AIR), PLASTIC.porosity, ratio)
    return assemble(cells, air_fluid(AIR), time_step(h), grains, walls, dtype)


def closed(
    region: Region, h: float, half: float, bottom: float, top: float, courant: float = 0.0
) -> tuple[Cells, System]:
    """Lossless air in rigid walls, at the usual time step or at a fixed Courant number."""
    cells = cut_cells(region, h, half, bottom, top)
    dt = courant * h / (np.sqrt(3) * AIR.sound_speed) if courant else time_step(h)
    return cells, assemble(cells, air_fluid(AIR), dt, walls=NO_WALLS)


def random_state(system: System, seed: int = 0) -> State:
    """Random pressure and velocity wherever there is something open."""
    rng = np.random.default_rng(seed)
    state = at_rest(system)
    live = system.mass.ravel() > 0
    state.p[live] = rng.standard_normal(live.sum())
    for u, gain in zip(state[1:4], system.faces[3:], strict=True):
        u[gain > 0] = rng.standard_normal((gain > 0).sum()) * gain.max()
    state.before[:] = state.p[system.walls.cell]
    return state


SILENT = Probe(np.zeros(1, np.uint64), np.zeros(1))


def energies(system: System, state: State, steps: int) -> np.ndarray:
    """The discrete energy before each of `steps` steps, marching `state`.

    ½‖p‖²_M + ½ Σ Δt/b [(1-a)/2 U⁻² + U⁻U⁺] + poles + walls, with a and b the decay and gain of a
    face. Its change in a step is -Σ Δt/2b (1-a)/2 (U⁻+U⁺)² and what poles and walls dissipate:
    constant without losses, never growing with them, both at round-off.
    """
    out = np.empty(steps)
    for n in range(steps):
        old = State(*(a.copy() for a in state))
        march(system, state, SILENT, SILENT, np.zeros(0), 1)
        total = np.sum(system.mass.ravel() * old.p**2)
        total += _kinetic(system, old, state)
        total += _stored(system, old)
        out[n] = total / 2
    return out


def _kinetic(system: System, old: State, new: State) -> float:
    total = 0.0
    for before, after, decay, gain in zip(
        old[1:4], new[1:4], system.faces[:3], system.faces[3:], strict=True
    ):
        open_ = gain > 0
        w, u, a = before[open_], after[open_], decay[open_]
        total += np.sum(system.dt / gain[open_] * ((1 - a) / 2 * w**2 + w * u))
    return float(total)


def _stored(system: System, state: State) -> float:
    c, walls, dt = system.capacities, system.walls, system.dt
    live, total = c.yield_ > 0, 0.0
    for q, back, rate in zip((state.q1, state.q2), (c.return1, c.return2), c.rates, strict=True):
        if rate > 0:
            total += np.sum(back[live] * dt / (2 * rate * c.yield_[live]) * q[live] ** 2)
    area = walls.coupling / (c.yield_[walls.cell] * walls.admittance)
    for force, impedance in ((state.momentum, walls.inertia), (state.tension, walls.half_spring)):
        some = impedance > 0
        total += np.sum(area[some] * force[some] ** 2 * dt / (2 * impedance[some]))
    modes = system.modes
    for force, impedance in zip(state.motion[:2], (modes.inertia, modes.half_spring), strict=True):
        some = impedance > 0
        total += np.sum(force[some] ** 2 * dt / (2 * impedance[some]))
    return float(total)


def frequencies(system: System, count: int) -> np.ndarray:
    """Lowest `count` resonances (Hz) of the lossless `system` as marched, but the static one."""
    live = np.flatnonzero(system.mass.ravel())
    number = np.full(system.mass.size, -1)
    number[live] = np.arange(len(live))
    rows, columns, values = [], [], []
    steps = (1, system.span.row, system.span.slab)
    for gain, step in zip(system.faces[3:], steps, strict=True):
        face = np.flatnonzero(gain)
        i, j, g = number[face], number[face + step], gain[face] / system.dt
        rows += [i, j, i, j]
        columns += [i, j, j, i]
        values += [g, g, -g, -g]
    root = 1 / np.sqrt(system.mass.ravel()[live])
    stiffness = coo_array(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    ).tocsc()
    operator = diags_array(root) @ stiffness @ diags_array(root)
    start = np.random.default_rng(0).standard_normal(len(live))
    squares = eigsh(operator.tocsc(), count + 1, sigma=-1e6, v0=start, return_eigenvectors=False)
    omega = 2 / system.dt * np.arcsin(np.sqrt(np.sort(squares)[1:]) * system.dt / 2)
    return omega / (2 * np.pi)


def check_convergence(
    sizes: Sequence[float], errors: Sequence[float], *, order: float, cap: float
) -> None:
    """The fitted order is at least `order`, and the finest error at most `cap`."""
    slope = np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    assert slope >= order, f"order {slope:.2f} < {order} from {sizes}, {errors}"
    assert errors[-1] <= cap, f"error {errors[-1]:.2e} > {cap}"
