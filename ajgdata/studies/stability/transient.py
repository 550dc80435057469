"""How much a state can grow, whatever it is: in one step, and at any time later.

In the energy E of `discrete_energy` a step is T with E(x) - E(Tx) = L(x), L a sum of squares: no
state gains energy. With N the stored energy, (1 - s) N ≤ E ≤ (1 + s) N, where s is the sine
sin(ωΔt/2) of the fastest wave, and drag makes a face as fast as a gain of 2b/(1+a): s < 1 is what
cells are enlarged for. Hence the stored energy of no state grows by more than (1 + s)/(1 - s), at
no time; for waves of frequency f alone s is sin(πfΔt). Without losses the fastest wave gets there.

What rounding leaves of the balance is R(x) = E(x) - E(Tx) - L(x). Its eigenvalues relative to N are
at most its Frobenius norm, and for normal random x of unit N each, E[R(x)²] ≥ 2 ‖R‖²; so a step
gains at most ‖R‖/(1 - s) of the energy of any state, and n steps at most n times that.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ajgdata.gripper.system import Capacities, Faces, System
from ajgdata.gripper.walls import NO_MODES, Walls, coupled
from ajgdata.studies.discrete_energy import (
    dissipated,
    energy,
    marched,
    random_state,
    stored_weights,
)
from ajgdata.studies.discrete_operator import fastest

#: Random states: an error of a single coefficient, a form of rank one, is seen as a tenth of itself
#: or more by all but 1e-6 of their draws.
DRAWS = 16
#: Steps for which growth is bounded: three times as many as the default marches at most.
STEPS = 100_000
#: Roundings of one term of the balance: 16 in its weight and the kernel's coefficients, for each of
#: the energies before and after and for what is dissipated, and as many in their sums.
ROUNDINGS = 64


@dataclass(frozen=True)
class Transient:
    """Bounds for all states: energy gained in a step, relative; growth of the stored energy within
    STEPS. `balance` is what is left of the energy balance, in roundings of it."""

    gain: float
    growth: float
    balance: float

    @property
    def bounded(self) -> bool:
        """True if nothing but rounding is left of the balance, and the bound is one."""
        return self.balance <= ROUNDINGS and bool(np.isfinite(self.growth))


def transient(system: System) -> Transient:
    """Return how much any state of a float64 `system` can grow."""
    left, balance = np.empty(DRAWS), np.empty(DRAWS)
    weight = stored_weights(system)
    for seed in range(DRAWS):
        states = [random_state(system, seed)]
        states += [marched(system, states[-1])]
        states += [marched(system, states[-1])]
        before, after = (energy(system, weight, *states[n : n + 2]) for n in (0, 1))
        lost = dissipated(system, *states[:2])
        # Of x of unit N each: twice the energy is the sum of as many squares.
        left[seed] = 2 * (before - after - lost)
        balance[seed] = abs(before - after - lost) / (before + after + lost) * 2**53
    sine = np.sqrt(fastest(without_losses(system))) / 2
    if not sine < 1:
        return Transient(np.inf, np.inf, float(balance.max()))
    gain = float(np.sqrt(np.mean(left**2) / 2) / (1 - sine))
    with np.errstate(over="ignore"):
        growth = float((1 + sine) / (1 - sine) * np.exp(STEPS * gain))
    return Transient(gain, growth, float(balance.max()))


def without_losses(system: System) -> System:
    """Return the leapfrog of `system` alone, with the gains 2b/(1+a) that drag makes of b."""
    gains = [2 * b / (1 + a) for a, b in zip(system.faces[:3], system.faces[3:], strict=True)]
    faces = Faces(*(np.ones_like(gain) for gain in gains), *gains)
    mass = system.mass.ravel()
    yield_ = np.divide(system.dt, mass, out=np.zeros_like(mass), where=mass > 0)
    none = np.zeros_like(mass)
    capacities = Capacities(yield_, np.ones_like(mass), none, none, np.array([0.0, 0.0, 1.0, 1.0]))
    walls = Walls(np.zeros(0, np.uint64), *(np.zeros(0) for _ in range(4)))
    modes = coupled(NO_MODES, yield_, system.dt)
    return replace(system, faces=faces, capacities=capacities, walls=walls, modes=modes)
