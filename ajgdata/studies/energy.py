"""Discrete energy of the simulation, and the limit of its time step.

With decay a and gain b of a face, and the pressure difference Dp across it, the energy is
½‖p‖²_M + ½ Σ Δt/b [(1-a)/2 U⁻² + U⁻U⁺] + poles + walls + modes. Because U⁺ = a U⁻ - b Dp, it is a
quadratic form of one state: the *stored* energy N, a sum of squares, minus Δt/2 Σ U⁻Dp. A step
changes it by -Σ Δt/2b (1-a)/2 (U⁻+U⁺)² and by the dissipation of poles, walls and modes, for every
stencil whose divergence is the adjoint of its gradient. The energy therefore never rises.

(1 - s) N ≤ E ≤ (1 + s) N, where s = sin(ωΔt/2) belongs to the fastest wave. Drag makes a face as
fast as a gain of 2b/(1+a). Cells are enlarged so that s < 1. The stored energy of any state
therefore grows by a factor of at most (1 + s)/(1 - s).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, eigsh

from ajgdata.gripper.solver import Probe, State, at_rest, march
from ajgdata.gripper.system import Capacities, Faces, System
from ajgdata.gripper.walls import NO_MODES, Walls, coupled

Real = NDArray[np.floating]
#: Source and receiver without sound, for steps that only march the state.
SILENT_PROBE = Probe(np.zeros(1, np.uint64), np.zeros(1))


def applied(system: System, p: Real) -> Real:
    """Return A p for a pressure p in all cells, both (cells,), from a step of the kernel.

    A lossless `system` satisfies p₊ - 2p + p₋ = -A p, so the pressure after a step from rest is
    p - A p.
    """
    state = at_rest(system)
    state.p[:] = p
    march(system, state, SILENT_PROBE, SILENT_PROBE, np.zeros(0), 1)
    return p - state.p


def symmetric_operator(system: System) -> tuple[LinearOperator, Real]:
    """Return M^½ A M^-½ of `applied` on the open cells (n, n), and M^½ (n,)."""
    live = np.flatnonzero(system.mass.ravel())
    root = np.sqrt(system.mass.ravel()[live])
    everywhere = np.zeros(system.mass.size)

    def times(x: Real) -> Real:
        everywhere[live] = np.ravel(x) / root
        return root * applied(system, everywhere)[live]

    return LinearOperator((len(live), len(live)), matvec=times, dtype=float), root


def fastest(system: System) -> float:
    """Return the largest eigenvalue of A; systems are stable up to 4, where sin²(ωΔt/2) = 1."""
    matrix, root = symmetric_operator(system)
    start = np.random.default_rng(0).standard_normal(len(root))
    return float(eigsh(matrix, 1, which="LA", v0=start, return_eigenvectors=False)[0])


def largest_growth(system: System) -> float:
    """Return the largest factor by which the stored energy of any state can grow.

    It is infinite if the energy of some state is not positive, which allows unlimited growth.
    """
    sine = np.sqrt(fastest(without_losses(system))) / 2
    if sine >= 1:
        return np.inf
    return float((1 + sine) / (1 - sine))


def without_losses(system: System) -> System:
    """Return only the leapfrog of `system`, with the gains 2b/(1+a) to which drag changes b."""
    gains = [2 * b / (1 + a) for a, b in zip(system.faces[:3], system.faces[3:], strict=True)]
    faces = Faces(*(np.ones_like(gain) for gain in gains), *gains)
    mass = system.mass.ravel()
    yield_ = np.divide(system.dt, mass, out=np.zeros_like(mass), where=mass > 0)
    none = np.zeros_like(mass)
    capacities = Capacities(yield_, np.ones_like(mass), none, none, np.array([0.0, 0.0, 1.0, 1.0]))
    walls = Walls(np.zeros(0, np.uint64), *(np.zeros(0) for _ in range(4)))
    modes = coupled(NO_MODES, yield_, system.dt)
    return replace(system, faces=faces, capacities=capacities, walls=walls, modes=modes)


def energies(system: System, state: State, steps: int) -> Real:
    """March `state`, and return the discrete energy (J) before each of `steps` steps, (steps,)."""
    weight = stored_weights(system)
    out = np.empty(steps)
    for n in range(steps):
        before = State._make(values.copy() for values in state)
        march(system, state, SILENT_PROBE, SILENT_PROBE, np.zeros(0), 1)
        out[n] = _energy(system, weight, before, state)
    return out


def _energy(system: System, weight: State, before: State, after: State) -> float:
    """Return the energy (J) of the state `before` the step to the state `after`."""
    stored = _with_densities(system, State._make(v.astype(np.float64) for v in before), 1.0)
    total = sum(float(np.sum(w * np.square(v))) for w, v in zip(weight, stored, strict=True))
    for name, decay, gain in _faces(system):
        old = getattr(before, name).astype(np.float64)
        new = getattr(after, name).astype(np.float64)
        total += float(np.sum(_ratio(system.dt * old * (new - decay * old), gain)))
    return total / 2


def random_state(system: System, seed: int = 0) -> State:
    """Return a state of normal random numbers, each with the same mean energy."""
    weight = stored_weights(system)
    ends = np.cumsum([np.count_nonzero(w) for w in weight])
    numbers = np.random.default_rng(seed).standard_normal(ends[-1])
    full = State._make(np.zeros_like(w) for w in weight)
    for into, w, part in zip(full, weight, np.split(numbers, ends[:-1]), strict=True):
        into[w > 0] = part / np.sqrt(w[w > 0])
    state = at_rest(system)
    for into, values in zip(state, _with_densities(system, full, -1.0), strict=True):
        into[:] = values
    # Walls and modes store the pressure of the step before.
    state.before[:] = state.p[system.walls.cell]
    if len(system.modes.inertia):
        state.motion[2] = system.modes.weight @ state.p[system.modes.cell]
    return state


def stored_weights(system: System) -> State:
    """Return twice the stored energy per square of each number of a state; 0 for fixed numbers.

    The weight of r_j is that of the relaxing density q_j = r_j + rate_j p.
    """
    c = system.capacities
    walls = system.walls
    modes = system.modes
    dt = system.dt
    yield_ = c.yield_.astype(np.float64)
    rates = c.rates.astype(np.float64)
    flows = [_ratio(dt * (1 + decay), 2 * gain) for _, decay, gain in _faces(system)]
    densities = [
        _ratio(back * dt, 2 * rate * yield_)
        for back, rate in zip((c.return1, c.return2), rates, strict=False)
    ]
    area = walls.coupling / (yield_[walls.cell] * walls.admittance.astype(np.float64))
    moving = [_ratio(area * dt, 2 * part) for part in (walls.inertia, walls.half_spring)]
    none = np.zeros_like(area)
    free = np.full(len(modes.inertia), dt)
    swinging = [_ratio(free, 2 * part) for part in (modes.inertia, modes.half_spring)]
    motion = np.stack([*swinging, np.zeros_like(free)])
    return State._make([system.mass.ravel(), *flows, *densities, *moving, none, motion])


def _faces(system: System) -> Iterator[tuple[str, Real, Real]]:
    """Return an iterator over the axes: name of the flow, decay and gain."""
    faces = [values.astype(np.float64) for values in system.faces]
    return zip(("ux", "uy", "uz"), faces[:3], faces[3:], strict=True)


def _with_densities(system: System, state: State, sign: float) -> State:
    """Return `state` with q = r + rate p instead of r; `sign` -1 inverts this."""
    rate1 = sign * float(system.capacities.rates[0])
    rate2 = sign * float(system.capacities.rates[1])
    return state._replace(r1=state.r1 + rate1 * state.p, r2=state.r2 + rate2 * state.p)


def _ratio(above: Real, below: Real) -> Real:
    """Return `above` / `below` in float64; 0 where `below` is 0."""
    above = np.asarray(above, np.float64)
    return np.divide(above, below, out=np.zeros_like(above), where=below > 0)
