"""Long runs and short words: growth, drift of the static pressure, float32 against float64."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper import Scene, simulate
from ajgdata.gripper.scene import Precision
from ajgdata.gripper.solver import State, march
from ajgdata.gripper.system import System
from ajgdata.studies.discrete_energy import energies, random_state
from ajgdata.studies.domains import BOWL, SILENT, bowl
from known_cases.case import Bound
from known_cases.domains import closed

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
