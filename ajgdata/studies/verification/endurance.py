"""Long runs and short words: growth, drift of the static pressure, float32 against float64."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper import Scene, simulate
from ajgdata.gripper.solver import at_rest, march
from ajgdata.gripper.system import System
from ajgdata.studies.discrete_operator import energies
from ajgdata.studies.domains import (
    BOWL,
    SILENT,
    bowl,
    closed,
    lossy_bowl,
    random_state,
    two_probes,
)
from ajgdata.studies.verification.case import Bound

Real = NDArray[np.floating]
H = 6e-3


def mean_pressure(system: System, p: Real) -> float:
    """Mean over the volume: what a closed rigid cavity may never change."""
    mass = system.mass.ravel()
    return float(np.sum(mass * p.astype(np.float64)) / mass.sum())


class LongRunLossless(Bound):
    """The energy of a closed cavity after a million steps."""

    title = "energy of a lossless cavity after 1,000,000 steps"
    derived = "each step may round the whole energy once, at random: √steps ε"
    dtype: type = np.float64

    def deviation(self, quick: bool) -> float:
        """Largest relative change."""
        _, system = closed(bowl(), H, *BOWL, dtype=self.dtype)
        state = random_state(system)
        before = energies(system, state, 1)[0]
        march(system, state, SILENT, SILENT, np.zeros(0), self._steps(quick))
        return float(abs(energies(system, state, 1)[0] / before - 1))

    def cap(self, quick: bool) -> float:
        """See `derived`."""
        return self._steps(quick) ** 0.5 * float(np.finfo(self.dtype).eps)

    def _steps(self, quick: bool) -> int:
        return 50_000 if quick else 1_000_000


class LongRunLosslessSingle(LongRunLossless):
    """The same in float32."""

    title = "energy of a lossless cavity after 1,000,000 steps, float32"
    dtype = np.float32


class StaticDrift(LongRunLossless):
    """The mean pressure of a closed cavity, which is its volume of air, over a long run."""

    title = "drift of the mean pressure in 1,000,000 steps, relative to the rms pressure"
    derived = "each step may round the mean once, at random: √steps ε of the rms pressure"

    def deviation(self, quick: bool) -> float:
        """Change of the mean over the rms pressure at the start."""
        _, system = closed(bowl(), H, *BOWL, dtype=self.dtype)
        state = random_state(system)
        before = mean_pressure(system, state.p)
        live = system.mass.ravel() > 0
        scale = float(np.sqrt(np.mean(state.p[live].astype(np.float64) ** 2)))
        march(system, state, SILENT, SILENT, np.zeros(0), self._steps(quick))
        return abs(mean_pressure(system, state.p) - before) / scale


class StaticDriftSingle(StaticDrift):
    """The same in float32."""

    title = "drift of the mean pressure in 1,000,000 steps, float32"
    dtype = np.float32


class LongRunDriven(Bound):
    """Grains and walls of every kind under a tone that never stops: as loud late as early."""

    title = "level of a lossy cavity under a tone of 1,000,000 steps, change once settled; float32"
    derived = "roundings at random that were never to die away: √steps ε"
    period, periods = 64, 32

    def deviation(self, quick: bool) -> float:
        """Largest relative change within the second half, the slow static pressure apart."""
        system = lossy_bowl(H, np.float32)
        source, receiver = two_probes(system)
        state = at_rest(system)
        tone = np.sin(2 * np.pi * np.arange(self.periods * self.period) / self.period)
        levels = np.array(
            [
                np.std(march(system, state, source, receiver, tone, len(tone))[-self.period :])
                for _ in range(self._steps(quick) // len(tone))
            ]
        )
        settled = levels[len(levels) // 2 :]
        return float(np.max(np.abs(settled / settled[0] - 1)))

    def cap(self, quick: bool) -> float:
        """See `derived`."""
        return self._steps(quick) ** 0.5 * float(np.finfo(np.float32).eps)

    def _steps(self, quick: bool) -> int:
        return 50_000 if quick else 1_000_000


class SinglePrecision(Bound):
    """A whole scene in float32 and in float64."""

    title = "float32 against float64, response of a scene, relative L2"
    derived = "one rounding a step, all alike: steps ε"

    def deviation(self, quick: bool) -> float:
        """Relative L2 difference of the responses."""
        single, double = (
            simulate(Scene.model_validate(_cube(precision))) for precision in ("float32", "float64")
        )
        self._steps = double.provenance["steps"]
        n = min(len(single.samples), len(double.samples))
        error = np.linalg.norm(single.samples[:n] - double.samples[:n])
        return float(error / np.linalg.norm(double.samples[:n]))

    def cap(self, quick: bool) -> float:
        """See `derived`."""
        return self._steps * float(np.finfo(np.float32).eps)


def _cube(precision: str) -> dict:
    return {
        "object": {"kind": "cube", "edge_mm": 20},
        "numerics": {"dx_mm": 4.0, "precision": precision},
    }
