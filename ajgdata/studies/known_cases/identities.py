"""Energy, reciprocity and dispersion at round-off on every grid; float32 compared with float64."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper import ImpulseResponse, Scene, build_plan, simulate
from ajgdata.gripper.solver import Probe, State, at_rest, march
from ajgdata.gripper.solver_plan import wide_weight
from ajgdata.gripper.system import System
from ajgdata.studies.energy import applied, energies, random_state
from ajgdata.studies.extreme_cases import AIR, BOWL, bowl
from ajgdata.studies.known_cases.case import EPS, Identity, KnownCase, KnownCaseResult
from ajgdata.studies.known_cases.domains import lossy_bowl
from ajgdata.studies.rigid_domains import box, closed

Real = NDArray[np.floating]


class EnergyConstant(Identity):
    """Energy of random pressure and flow in a closed cavity of cut cells."""

    title = "energy of a closed lossless cavity is constant"
    derived = "each step may round the whole energy once, at random: √steps ε"
    power: ClassVar[float] = 0.5

    def start(self) -> tuple[System, State]:
        """Return a system and its state at the start."""
        system = closed(bowl(), 4e-3, *BOWL)[1]
        return system, random_state(system)

    def deviation(self, quick: bool) -> float:
        """Return the difference of the largest and the smallest energy, relative to the first."""
        energy = energies(*self.start(), self._steps(quick))
        return float(np.ptp(energy) / energy[0])

    def cap(self, quick: bool) -> float:
        """Return the largest deviation that passes; `derived` gives its derivation."""
        return self._steps(quick) ** self.power * EPS

    def _steps(self, quick: bool) -> int:
        return 500 if quick else 2_000


class EnergyNeverGrows(Identity):
    """Energy of random pressure and flow in unevenly packed grains with walls of every kind."""

    title = "energy never grows with drag, relaxation and walls"
    derived = "the roundings of one step, all alike: 4 ε of the energy"
    roundings = 4
    #: The final energy must be below this share of the first, because the claim is empty otherwise.
    largest_final_share: ClassVar[float] = 0.5

    def start(self) -> tuple[System, State]:
        """Return a system and its state at the start."""
        system = lossy_bowl(4e-3)
        return system, random_state(system)

    def deviation(self, quick: bool) -> float:
        """Return the largest growth in one step, relative to the energy before the step."""
        energy = energies(*self.start(), 500 if quick else 2_000)
        if not 0 < energy[-1] < self.largest_final_share * energy[0]:
            return np.inf
        return float(max(0.0, np.max(np.diff(energy) / energy[:-1])))


class Reciprocity(Identity):
    """Exchange of speaker and microphone in a complete scene with an object."""

    title = "speaker and microphone may change places"
    derived = "one rounding a step, at random: √steps ε, of the largest pressure"
    steps = 1_500
    roundings = steps**0.5

    def ends(self) -> tuple[System, Probe, Probe]:
        """Return the system, its speaker and its microphone."""
        solid = {"kind": "cube", "edge_mm": 20}
        numerics = {"dx_mm": 5.0, "precision": "float64"}
        plan = build_plan(Scene.model_validate({"object": solid, "numerics": numerics}))
        return plan.system, plan.speaker, plan.microphone

    def deviation(self, quick: bool) -> float:
        """Return the largest difference, relative to the largest pressure."""
        system, first, second = self.ends()
        there = self.pressure(system, first, second)
        back = self.pressure(system, second, first)
        return float(np.max(np.abs(there - back)) / np.max(np.abs(there)))

    def pressure(self, system: System, source: Probe, receiver: Probe) -> Real:
        """Return the pressure at `receiver`, (steps,), after a pulse at `source`."""
        return march(system, at_rest(system), source, receiver, np.ones(1), self.steps)


class WaveDispersion(Identity):
    """Dispersion of a plane wave far from walls: sin²(ωΔt/2) = (cΔt/h)² Σ s(k)².

    s is the symbol of the four-point difference, (1 + 3w) sin(k h/2) - w sin(3 k h/2).
    """

    title = "a plane wave has the dispersion of the four-point differences"
    derived = "the roundings of a step: 32 ε"
    roundings = 32
    h = 4e-3  #: grid spacing (m)
    count = 14  #: cells per edge of the box
    wave_vector = (110.0, -70.0, 40.0)  #: rad/m

    def deviation(self, quick: bool) -> float:
        """Return the largest difference after one step, for a wave of amplitude 1."""
        h = self.h
        edge = self.count * h
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
        weight = wide_weight(self.h)
        half = k * self.h / 2
        return float((1 + 3 * weight) * np.sin(half) - weight * np.sin(3 * half))


class SinglePrecision(KnownCase):
    """Response of a complete scene in float32 and in float64."""

    limit_type = "bound"
    title = "float32 against float64, response of a scene, relative L2"
    derived = "one rounding a step, all alike: steps ε"

    def run(self, quick: bool = False) -> KnownCaseResult:
        """Measure the relative L2 difference of the responses."""
        single = self._response("float32")
        double = self._response("float64")
        n = min(len(single.samples), len(double.samples))
        error = np.linalg.norm(single.samples[:n] - double.samples[:n])
        cap = double.provenance["steps"] * float(np.finfo(np.float32).eps)
        return self.result(float(error / np.linalg.norm(double.samples[:n])), cap)

    def _response(self, precision: str) -> ImpulseResponse:
        solid = {"kind": "cube", "edge_mm": 20}
        numerics = {"dx_mm": 4.0, "precision": precision}
        return simulate(Scene.model_validate({"object": solid, "numerics": numerics}))
