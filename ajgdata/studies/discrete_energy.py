"""The discrete energy of what is marched, and what each step takes from it.

With a, b the decay and gain of a face and D the difference of pressure across it, the energy is
½‖p‖²_M + ½ Σ Δt/b [(1-a)/2 U⁻² + U⁻U⁺] + poles + walls + modes. As U⁺ = a U⁻ - b Dp, it is a
quadratic form of one state: the *stored* energy, a sum of squares, less Δt/2 Σ U⁻Dp. A step
changes it by -Σ Δt/2b (1-a)/2 (U⁻+U⁺)² and by what poles, walls and modes dissipate, for every
stencil whose divergence is the adjoint of its gradient.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.solver import State, at_rest, march
from ajgdata.gripper.system import System
from ajgdata.gripper.walls import Modes
from ajgdata.studies.domains import SILENT

Real = NDArray[np.floating]


def copied(state: State) -> State:
    """Return a copy of `state` in float64."""
    return State._make(values.astype(np.float64) for values in state)


def marched(system: System, state: State) -> State:
    """Return the state that follows `state`, which stays unchanged."""
    following = State._make(values.copy() for values in state)
    march(system, following, SILENT, SILENT, np.zeros(0), 1)
    return following


def energies(system: System, state: State, steps: int) -> Real:
    """Return the discrete energy (J) before each of `steps` steps, (steps,), marching `state`."""
    weight, out = stored_weights(system), np.empty(steps)
    for n in range(steps):
        before = State._make(values.copy() for values in state)
        march(system, state, SILENT, SILENT, np.zeros(0), 1)
        out[n] = energy(system, weight, before, state)
    return out


def energy(system: System, weight: State, before: State, after: State) -> float:
    """Return the energy (J) of the state `before` the step to the state `after`.

    `weight` is that of `stored_weights`.
    """
    total = float(np.sum(numbers_of(system, weight, before) ** 2))
    for name, decay, gain in _faces(system):
        old, new = (getattr(state, name).astype(np.float64) for state in (before, after))
        total += float(np.sum(_ratio(system.dt * old * (new - decay * old), gain)))
    return total / 2


def numbers_of(system: System, weight: State, state: State) -> Real:
    """Return all that is free in `state` as numbers (n,); half their squares is the stored energy
    (J). `weight` is that of `stored_weights`.

    At the limit of the time step the fastest wave moves between pressure and flow along an ellipse
    that degenerates to a line: the energy stays, the stored energy does not.
    """
    full = _with_densities(system, copied(state), 1.0)
    return np.concatenate(
        [np.sqrt(w[w > 0]) * values[w > 0] for w, values in zip(weight, full, strict=True)]
    )


def state_of(system: System, weight: State, numbers: Real) -> State:
    """Return the state whose `numbers_of` are `numbers`."""
    ends = np.cumsum([np.count_nonzero(w) for w in weight])
    full = State._make(np.zeros_like(w) for w in weight)
    for into, w, part in zip(full, weight, np.split(numbers, ends[:-1]), strict=True):
        into[w > 0] = part / np.sqrt(w[w > 0])
    state = at_rest(system)
    for into, values in zip(state, _with_densities(system, full, -1.0), strict=True):
        into[:] = values
    # What walls and modes remember of the pressure before.
    state.before[:] = state.p[system.walls.cell]
    if len(system.modes.inertia):
        state.motion[2] = system.modes.weight @ state.p[system.modes.cell]
    return state


def random_state(system: System, seed: int = 0) -> State:
    """Return normal random numbers in all that a state can hold, each of the same mean energy."""
    weight = stored_weights(system)
    count = sum(np.count_nonzero(w) for w in weight)
    return state_of(system, weight, np.random.default_rng(seed).standard_normal(count))


def stored_weights(system: System) -> State:
    """Return twice the stored energy per square of each number of a state, 0 for what is not free.

    Of r_j it is that of the relaxing density q_j = r_j + rate_j p.
    """
    c, walls, modes, dt = system.capacities, system.walls, system.modes, system.dt
    yield_, rates = c.yield_.astype(np.float64), c.rates.astype(np.float64)
    flows = [_ratio(dt * (1 + decay), 2 * gain) for _, decay, gain in _faces(system)]
    densities = [
        _ratio(back * dt, 2 * rate * yield_)
        for back, rate in zip((c.return1, c.return2), rates, strict=False)
    ]
    area = wall_area(system)
    moving = [_ratio(area * dt, 2 * part) for part in (walls.inertia, walls.half_spring)]
    none, free = np.zeros_like(area), np.full(len(modes.inertia), dt)
    swinging = [_ratio(free, 2 * part) for part in (modes.inertia, modes.half_spring)]
    motion = np.stack([*swinging, np.zeros_like(free)])
    return State._make([system.mass.ravel(), *flows, *densities, *moving, none, motion])


def wall_area(system: System) -> Real:
    """Return the area (m²) of each wall of the kernel's, from its coefficients."""
    walls = system.walls
    at = system.capacities.yield_[walls.cell].astype(np.float64)
    return walls.coupling / (at * walls.admittance.astype(np.float64))


def dissipated(system: System, before: State, after: State) -> float:
    """Return what the step from `before` to `after` dissipates (J): a sum of squares."""
    old, new, weight = copied(before), copied(after), stored_weights(system)
    total = 0.0
    for name, decay, gain in _faces(system):
        twice = getattr(old, name) + getattr(new, name)
        total += float(np.sum(_ratio(system.dt * (1 - decay) * twice**2, 2 * gain)))
    full = [_with_densities(system, state, 1.0) for state in (old, new)]
    for name, rate in zip(("r1", "r2"), system.capacities.rates, strict=False):
        relaxed = getattr(full[1], name) - getattr(full[0], name)
        if rate > 0:
            total += float((1 - rate) / rate * np.sum(getattr(weight, name) * relaxed**2))
    return (total + _by_walls(system, old, new) + _by_modes(system, old, new)) / 2


def _by_walls(system: System, old: State, new: State) -> float:
    """Twice what walls dissipate: those of the kernel's, and those that only resist."""
    c, walls, dt = system.capacities, system.walls, system.dt
    area, force = wall_area(system), old.momentum - old.tension
    twice = walls.admittance * (old.p[walls.cell] + new.p[walls.cell] + 2 * force)
    resistance = 1 / walls.admittance - walls.inertia - walls.half_spring
    lost = dt / 2 * np.sum(area * np.maximum(resistance, 0) * twice**2)
    mass = system.mass.ravel()
    reacting = np.bincount(walls.cell.astype(np.int64), area * walls.admittance, mass.size)
    load = _ratio(system.dt * np.ones(mass.size), c.yield_.astype(np.float64))
    resisting = load - mass - (c.return1 + c.return2) * load / 2 - dt / 2 * reacting
    return float(lost + np.sum(np.maximum(resisting, 0) * (old.p + new.p) ** 2))


def _by_modes(system: System, old: State, new: State) -> float:
    """Twice what modes dissipate."""
    modes = system.modes
    if not len(modes.inertia):
        return 0.0
    impedance = mode_impedance(modes)
    spring = modes.inertia + modes.half_spring
    drive = old.motion[2] + new.motion[2] + 2 * (old.motion[0] - old.motion[1])
    twice = np.linalg.lstsq(impedance, drive)[0]
    scale = 1 / np.sqrt(np.diag(modes.gram) + spring)
    resistance = scale[:, None] * (impedance - np.diag(spring)) * scale
    share, shape = np.linalg.eigh((resistance + resistance.T) / 2)
    return float(system.dt / 2 * np.maximum(share, 0) @ (shape.T @ (twice / scale)) ** 2)


def mode_impedance(modes: Modes) -> Real:
    """Return Z⁻¹ = 2m/Δt + r + kΔt/2 (N, N) of all modes, from what the kernel uses."""
    scale = np.sqrt(np.diag(modes.inverse))
    inverse = np.linalg.inv(modes.inverse / np.outer(scale, scale)) / np.outer(scale, scale)
    return np.asarray(inverse - modes.gram)


def _faces(system: System) -> Iterator[tuple[str, Real, Real]]:
    """Name of the flow, decay and gain of each axis."""
    faces = [values.astype(np.float64) for values in system.faces]
    return zip(("ux", "uy", "uz"), faces[:3], faces[3:], strict=True)


def _with_densities(system: System, state: State, sign: float) -> State:
    """Return `state` with q = r + rate p instead of r; back again with `sign` -1."""
    rate1, rate2 = (sign * float(rate) for rate in system.capacities.rates[:2])
    return state._replace(r1=state.r1 + rate1 * state.p, r2=state.r2 + rate2 * state.p)


def _ratio(above: Real, below: Real) -> Real:
    """`above` / `below` in float64, 0 where `below` is."""
    above = np.asarray(above, np.float64)
    return np.divide(above, below, out=np.zeros_like(above), where=below > 0)
