"""Energy, reciprocity and dispersion at round-off on every grid; float32 against float64."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper import Scene, build_plan, simulate
from ajgdata.gripper.solver import Probe, State, at_rest, march
from ajgdata.gripper.solver_plan import wide_weight
from ajgdata.gripper.system import System
from ajgdata.studies.energy import applied, energies, random_state
from ajgdata.studies.extreme_cases import AIR, BOWL, bowl
from ajgdata.studies.rigid_domains import box, closed
from known_cases.case import EPS, Bound, Identity
from known_cases.domains import lossy_bowl

Real = NDArray[np.floating]


class EnergyConstant(Identity):
    """Random pressure and flow in a closed cavity of cut cells: what becomes of the energy."""

    title = "energy of a closed lossless cavity is constant"
    derived = "each step may round the whole energy once, at random: √steps ε"
    power: ClassVar[float] = 0.5

    def struck(self) -> tuple[System, State]:
        """Return the system and the field that is let go in it."""
        system = closed(bowl(), 4e-3, *BOWL)[1]
        return system, random_state(system)

    def deviation(self, quick: bool) -> float:
        """Return the largest less the smallest energy over the first."""
        energy = energies(*self.struck(), self._steps(quick))
        return float(np.ptp(energy) / energy[0])

    def cap(self, quick: bool) -> float:
        """See `derived`."""
        return self._steps(quick) ** self.power * EPS

    def _steps(self, quick: bool) -> int:
        return 500 if quick else 2_000


class EnergyNeverGrows(Identity):
    """Random pressure and flow in grains of uneven packing between walls of every kind."""

    title = "energy never grows with drag, relaxation and walls"
    derived = "the roundings of one step, all alike: 4 ε of the energy"
    roundings = 4
    #: It must fall to less than this share, or the claim is empty.
    left: ClassVar[float] = 0.5

    def struck(self) -> tuple[System, State]:
        """Return the system and the field that is let go in it."""
        system = lossy_bowl(4e-3)
        return system, random_state(system)

    def deviation(self, quick: bool) -> float:
        """Return the largest growth in a step, relative to the energy before it."""
        energy = energies(*self.struck(), 500 if quick else 2_000)
        if not 0 < energy[-1] < self.left * energy[0]:
            return np.inf
        return float(max(0.0, np.max(np.diff(energy) / energy[:-1])))


class Reciprocity(Identity):
    """In a whole scene: grains, membrane, housing, hose, object."""

    title = "speaker and microphone may change places"
    derived = "one rounding a step, at random: √steps ε, of the largest pressure"
    steps = 1_500
    roundings = steps**0.5

    def ends(self) -> tuple[System, Probe, Probe]:
        """Return the system and the two places in it."""
        plan = build_plan(
            Scene.model_validate(
                {
                    "object": {"kind": "cube", "edge_mm": 20},
                    "numerics": {"dx_mm": 5.0, "precision": "float64"},
                }
            )
        )
        return plan.system, plan.speaker, plan.microphone

    def deviation(self, quick: bool) -> float:
        """Return the largest difference over the largest pressure."""
        system, first, second = self.ends()
        there, back = self.pressure(system, first, second), self.pressure(system, second, first)
        return float(np.max(np.abs(there - back)) / np.max(np.abs(there)))

    def pressure(self, system: System, source: Probe, receiver: Probe) -> Real:
        """Return the pressure at `receiver`, (steps,), after a pulse at `source`."""
        return march(system, at_rest(system), source, receiver, np.ones(1), self.steps)


class WaveDispersion(Identity):
    """Far from walls a plane wave obeys sin²(ωΔt/2) = (cΔt/h)² Σ s(k)², with s the symbol of the
    four-point difference, (1 + 3w) sin(k h/2) - w sin(3 k h/2)."""

    title = "a plane wave has the dispersion of the four-point differences"
    derived = "the roundings of a step: 32 ε"
    roundings = 32
    h, count, wave_vector = 4e-3, 14, (110.0, -70.0, 40.0)

    def deviation(self, quick: bool) -> float:
        """Return the largest difference of a step, for a wave of height 1."""
        h, edge = self.h, self.count * self.h
        cells, system = closed(box(edge, edge, edge), h, edge / 2, 0.0, edge)
        x, y, z = np.meshgrid(cells.x, cells.y, cells.z - edge / 2, indexing="ij")
        kx, ky, kz = self.wave_vector
        p = np.cos(kx * x + ky * y + kz * z + 0.3).transpose(2, 1, 0)
        courant = AIR.sound_speed * system.dt / h
        rate = 4 * courant**2 * sum(self._symbol(k) ** 2 for k in self.wave_vector)
        change = applied(system, (p * (cells.volume > 0)).ravel()).reshape(p.shape) - rate * p
        inside = edge / 2 - 4 * h
        far = (np.abs([x, y, z]).max(0) < inside).transpose(2, 1, 0)
        return float(np.max(np.abs(change[far])))

    def _symbol(self, k: float) -> float:
        weight, half = wide_weight(self.h), k * self.h / 2
        return float((1 + 3 * weight) * np.sin(half) - weight * np.sin(3 * half))


class SinglePrecision(Bound):
    """A whole scene in float32 and in float64."""

    title = "float32 against float64, response of a scene, relative L2"
    derived = "one rounding a step, all alike: steps ε"

    def deviation(self, quick: bool) -> float:
        """Return the relative L2 difference of the responses."""
        single, double = (
            simulate(
                Scene.model_validate(
                    {
                        "object": {"kind": "cube", "edge_mm": 20},
                        "numerics": {"dx_mm": 4.0, "precision": precision},
                    }
                )
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
