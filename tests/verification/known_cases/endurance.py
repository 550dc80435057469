"""Long runs and short words: growth, drift of the static pressure, float32 against float64."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper import Scene, simulate
from ajgdata.gripper.scene import Precision
from ajgdata.gripper.solver import State, at_rest, march
from ajgdata.gripper.system import System
from ajgdata.studies.discrete_energy import energies, random_state
from ajgdata.studies.domains import BOWL, SILENT, bowl, two_probes
from known_cases.case import Bound
from known_cases.domains import closed, lossy_bowl

Real = NDArray[np.floating]
H = 6e-3
CUBE = {"object": {"kind": "cube", "edge_mm": 20}}


def mean_pressure(system: System, p: Real) -> float:
    """Mean over the volume of `p` (cells,), which a closed rigid cavity may never change."""
    mass = system.mass.ravel()
    return float(np.sum(mass * p.astype(np.float64)) / mass.sum())


@dataclass(eq=False)
class LongRun(Bound):
    """A run of very many steps in one precision."""

    precision: Precision = "float64"

    @property
    def dtype(self) -> type:
        """The floating-point type that is marched in."""
        return np.float64 if self.precision == "float64" else np.float32

    def closed_bowl(self) -> tuple[System, State]:
        """Return a lossless cavity and a random field that is let go in it."""
        _, system = closed(bowl(), H, *BOWL, dtype=self.dtype)
        return system, random_state(system)

    def cap(self, quick: bool) -> float:
        """See `derived`."""
        return self.steps(quick) ** 0.5 * float(np.finfo(self.dtype).eps)

    def steps(self, quick: bool) -> int:
        """Return the number of steps."""
        return 50_000 if quick else 1_000_000


class LongRunLossless(LongRun):
    """The energy of a closed cavity after a million steps."""

    title = "energy of a lossless cavity after 1,000,000 steps"
    derived = "each step may round the whole energy once, at random: √steps ε"

    def deviation(self, quick: bool) -> float:
        """Return the largest relative change."""
        system, state = self.closed_bowl()
        before = energies(system, state, 1)[0]
        march(system, state, SILENT, SILENT, np.zeros(0), self.steps(quick))
        return float(abs(energies(system, state, 1)[0] / before - 1))


class StaticDrift(LongRun):
    """The mean pressure of a closed cavity, which is its volume of air, over a long run."""

    title = "drift of the mean pressure in 1,000,000 steps, relative to the rms pressure"
    derived = "each step may round the mean once, at random: √steps ε of the rms pressure"

    def deviation(self, quick: bool) -> float:
        """Return the change of the mean over the rms pressure at the start."""
        system, state = self.closed_bowl()
        before = mean_pressure(system, state.p)
        live = system.mass.ravel() > 0
        scale = float(np.sqrt(np.mean(state.p[live].astype(np.float64) ** 2)))
        march(system, state, SILENT, SILENT, np.zeros(0), self.steps(quick))
        return abs(mean_pressure(system, state.p) - before) / scale


@dataclass(eq=False)
class LongRunDriven(LongRun):
    """Grains and walls of every kind under a tone that never stops: as loud late as early."""

    title = "level of a lossy cavity under a tone of 1,000,000 steps, change once settled; float32"
    derived = "roundings at random that were never to die away: √steps ε"
    period, periods = 64, 32
    precision: Precision = "float32"

    def deviation(self, quick: bool) -> float:
        """Return the largest relative change in the second half, the slow static pressure apart."""
        system = lossy_bowl(H, self.dtype)
        source, receiver = two_probes(system)
        state = at_rest(system)
        tone = np.sin(2 * np.pi * np.arange(self.periods * self.period) / self.period)
        levels = np.array(
            [
                np.std(march(system, state, source, receiver, tone, len(tone))[-self.period :])
                for _ in range(self.steps(quick) // len(tone))
            ]
        )
        settled = levels[len(levels) // 2 :]
        return float(np.max(np.abs(settled / settled[0] - 1)))


class SinglePrecision(Bound):
    """A whole scene in float32 and in float64."""

    title = "float32 against float64, response of a scene, relative L2"
    derived = "one rounding a step, all alike: steps ε"

    def deviation(self, quick: bool) -> float:
        """Return the relative L2 difference of the responses."""
        single, double = (
            simulate(
                Scene.model_validate({**CUBE, "numerics": {"dx_mm": 4.0, "precision": precision}})
            )
            for precision in ("float32", "float64")
        )
        self._steps = double.provenance["steps"]
        n = min(len(single.samples), len(double.samples))
        error = np.linalg.norm(single.samples[:n] - double.samples[:n])
        return float(error / np.linalg.norm(double.samples[:n]))

    def cap(self, quick: bool) -> float:
        """See `derived`."""
        return self._steps * float(np.finfo(np.float32).eps)
