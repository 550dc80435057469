"""Long runs and float32: growth of the energy, and the response of a scene."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ajgdata.gripper import Scene, simulate
from ajgdata.gripper.scene import Precision
from ajgdata.gripper.solver import march
from ajgdata.studies.energy import SILENT, energies, random_state
from ajgdata.studies.extreme_cases import BOWL, bowl
from known_cases.case import Bound
from known_cases.domains import closed

CUBE = {"object": {"kind": "cube", "edge_mm": 20}}


@dataclass(eq=False)
class LongRunLossless(Bound):
    """The energy of a closed cavity after a million steps."""

    title = "energy of a lossless cavity after 1,000,000 steps"
    derived = "each step may round the whole energy once, at random: √steps ε"
    precision: Precision = "float64"

    def cap(self, quick: bool) -> float:
        """See `derived`."""
        return self.steps(quick) ** 0.5 * float(np.finfo(self.precision).eps)

    def steps(self, quick: bool) -> int:
        """Return the number of steps."""
        return 50_000 if quick else 1_000_000

    def deviation(self, quick: bool) -> float:
        """Return the largest relative change."""
        _, system = closed(bowl(), 6e-3, *BOWL, dtype=np.dtype(self.precision).type)
        state = random_state(system)
        before = energies(system, state, 1)[0]
        march(system, state, SILENT, SILENT, np.zeros(0), self.steps(quick))
        return float(abs(energies(system, state, 1)[0] / before - 1))


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
