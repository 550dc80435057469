"""What holds at round-off, whatever the grid: energy, reciprocity, linearity, dispersion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper import Scene, build_plan, simulate
from ajgdata.gripper.solver import at_rest, march
from ajgdata.gripper.solver_plan import wide_weight
from ajgdata.gripper.system import System
from ajgdata.studies.discrete_operator import applied, energies, operator
from ajgdata.studies.domains import (
    AIR,
    BOWL,
    SILENT,
    bowl,
    box,
    closed,
    lossy_bowl,
    random_state,
    two_probes,
)
from ajgdata.studies.verification.case import Identity

Real = NDArray[np.floating]
EPS = float(np.finfo(float).eps)


class ClosedBowl(Identity):
    """In a closed lossless cavity full of cut cells."""

    wide = False

    def system(self, h: float) -> System:
        """What is examined."""
        return closed(bowl(), h, *BOWL, wide=self.wide)[1]


class EnergyConstant(ClosedBowl):
    """Random pressure and flow, and what becomes of their energy."""

    title = "energy of a closed lossless cavity is constant"
    derived = "each step may round the whole energy once, at random: √steps ε"

    def deviation(self, quick: bool) -> float:
        """Largest less smallest energy over the first."""
        system = self.system(4e-3)
        energy = energies(system, random_state(system), self._steps(quick))
        return float(np.ptp(energy) / energy[0])

    def cap(self, quick: bool) -> float:
        """See `derived`."""
        return self._steps(quick) ** 0.5 * EPS

    def _steps(self, quick: bool) -> int:
        return 500 if quick else 2_000


class EnergyNeverGrows(Identity):
    """Random pressure and flow in grains of uneven packing between walls of every kind."""

    title = "energy never grows with drag, relaxation and walls"
    derived = "the roundings of one step, all alike: 4 ε of the energy"
    wide = False

    def deviation(self, quick: bool) -> float:
        """Largest growth in a step, relative to the energy before it."""
        system = lossy_bowl(4e-3, wide=self.wide)
        energy = energies(system, random_state(system), 500 if quick else 2_000)
        if not 0 < energy[-1] < energy[0] / 2:
            return np.inf  # it must dissipate, or the claim is empty
        return float(max(0.0, np.max(np.diff(energy) / energy[:-1])))

    def cap(self, quick: bool) -> float:
        """See `derived`."""
        return 4 * EPS


class Adjoint(ClosedBowl):
    """The divergence is the adjoint of the gradient, cut cells and all: M A is symmetric."""

    title = "the marched operator is self-adjoint"
    derived = "the rounding of its largest entry: 4 ε"

    def deviation(self, quick: bool) -> float:
        """Largest difference from the transpose over the largest entry."""
        system = self.system(6e-3 if quick else 4e-3)
        mass = system.mass.ravel()
        symmetric = operator(system).multiply(mass[mass > 0][:, None]).tocsc()
        return float(abs(symmetric - symmetric.T).max() / abs(symmetric).max())

    def cap(self, quick: bool) -> float:
        """See `derived`."""
        return 4 * EPS


class WideEnergyConstant(EnergyConstant):
    """By the four-point scheme."""

    title = "energy of a closed lossless cavity is constant, wide scheme"
    wide = True


class WideEnergyNeverGrows(EnergyNeverGrows):
    """By the four-point scheme."""

    title = "energy never grows with drag, relaxation and walls, wide scheme"
    wide = True


class WideAdjoint(Adjoint):
    """By the four-point scheme."""

    title = "the marched operator is self-adjoint, wide scheme"
    wide = True


class Reciprocity(Identity):
    """In a whole scene: grains, membrane, housing, hose, object."""

    title = "speaker and microphone may change places"
    derived = "one rounding a step, at random: √steps ε, of the largest pressure"

    steps = 1_500

    def deviation(self, quick: bool) -> float:
        """Largest difference over the largest pressure."""
        plan = build_plan(_scene())
        ends = (plan.speaker, plan.microphone)
        there, back = (
            march(plan.system, at_rest(plan.system), *pair, np.ones(1), self.steps)
            for pair in (ends, ends[::-1])
        )
        return float(np.max(np.abs(there - back)) / np.max(np.abs(there)))

    def cap(self, quick: bool) -> float:
        """See `derived`."""
        return self.steps**0.5 * EPS


class Linearity(Identity):
    """The response to a sum is the sum of the responses."""

    title = "the response is linear"
    derived = "one rounding a step, at random, in each of three responses: 3 √steps ε"

    steps = 600

    def deviation(self, quick: bool) -> float:
        """Largest difference over the largest pressure."""
        system = lossy_bowl(4e-3)
        source, receiver = two_probes(system)
        x, y = np.random.default_rng(1).standard_normal((2, 300))
        one, two, both = (
            march(system, at_rest(system), source, receiver, drive, self.steps)
            for drive in (x, y, 2 * x - 3 * y)
        )
        return float(np.max(np.abs(both - (2 * one - 3 * two))) / np.max(np.abs(both)))

    def cap(self, quick: bool) -> float:
        """See `derived`."""
        return 3 * self.steps**0.5 * EPS


class BoxDispersion(Identity):
    """A mode of a box on the grid obeys sin²(ωΔt/2) = (cΔt/h)² Σ sin²(k h/2) to the last digit."""

    title = "a box mode has the dispersion of the scheme"
    derived = "the roundings of two steps and of the mode's cosines: 16 ε"

    steps, h, counts, orders = 200, 4e-3, (12, 8, 10), (3, 2, 1)

    def deviation(self, quick: bool) -> float:
        """Largest residual of the recurrence p₊ - 2 cos(ωΔt) p + p₋ for a mode of height 1."""
        system, shape, waves = self._mode()
        state = at_rest(system)
        state.p[:] = shape.ravel()
        courant = AIR.sound_speed * system.dt / self.h
        twice_cosine = 2 - 4 * courant**2 * sum(self._symbol(k) ** 2 for k in waves)
        history = [state.p.copy()]
        for _ in range(self.steps):
            march(system, state, SILENT, SILENT, np.zeros(0), 1)
            history.append(state.p.copy())
        p = np.array(history[1:])
        return float(np.max(np.abs(p[2:] - twice_cosine * p[1:-1] + p[:-2])))

    def _mode(self) -> tuple[System, Real, list[float]]:
        h, counts = self.h, self.counts
        cells, system = closed(box(*(n * h for n in counts)), h, 7 * h, 0.0, counts[2] * h)
        live = cells.volume > 0
        if live.sum() != np.prod(counts):
            raise ValueError("the box does not fill its cells")
        waves = [np.pi * m / (n * h) for m, n in zip(self.orders, counts, strict=True)]
        corners = (counts[0] / 2 * h, counts[1] / 2 * h, 0.0)
        x, y, z = (
            np.cos(k * (axis + corner))
            for k, axis, corner in zip(waves, (cells.x, cells.y, cells.z), corners, strict=True)
        )
        return system, live * z[:, None, None] * y[None, :, None] * x[None, None, :], waves

    def _symbol(self, k: float) -> float:
        return float(np.sin(k * self.h / 2))

    def cap(self, quick: bool) -> float:
        """See `derived`."""
        return 16 * EPS


class WaveDispersion(Identity):
    """Far from walls a plane wave obeys sin²(ωΔt/2) = (cΔt/h)² Σ s(k)², with s the symbol of the
    four-point difference, (1 + 3w) sin(k h/2) - w sin(3 k h/2)."""

    title = "a plane wave has the dispersion of the wide scheme"
    derived = "the roundings of a step: 32 ε"
    h, count, wave_vector = 4e-3, 14, (110.0, -70.0, 40.0)

    def deviation(self, quick: bool) -> float:
        """Largest difference of a step, for a wave of height 1."""
        h, edge = self.h, self.count * self.h
        cells, system = closed(box(edge, edge, edge), h, edge / 2, 0.0, edge, wide=True)
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

    def cap(self, quick: bool) -> float:
        """See `derived`."""
        return 32 * EPS


class Unused(Identity):
    """Scenes that differ in what is not there: grains of an empty gripper, pose of no object."""

    title = "what a scene does not use changes no bit"
    derived = "equal bytes"

    def deviation(self, quick: bool) -> float:
        """Number of samples that differ."""
        empty = {"object": None, "medium": {"kind": "air"}}
        grains = {"kind": "air", "grain_diameter_mm": 3.0, "porosity": 0.5}
        others = (
            {"medium": grains, "gripper": {"bed_depth_mm": 10.0}},
            {"grasp": {"angle_deg": 33.0, "force_n": 5.0, "offset_x_mm": 3.0}},
            {"grasp": {"nuisance": {"packing": 0.1, "roughness_mm": 2.0, "force": 0.1}}},
        )
        reference = self._samples(empty)
        found = 0
        for other in others:
            samples = self._samples({**empty, **other})
            if len(samples) != len(reference):
                return np.inf
            found += int(np.count_nonzero(samples.view(np.int64) != reference.view(np.int64)))
        return float(found)

    def _samples(self, parts: dict) -> Real:
        numerics = {"dx_mm": 5.0, "max_time_s": 0.01}
        return simulate(Scene.model_validate({**parts, "numerics": numerics})).samples

    def cap(self, quick: bool) -> float:
        """See `derived`."""
        return 0.0


def _scene() -> Scene:
    return Scene.model_validate(
        {
            "object": {"kind": "cube", "edge_mm": 20},
            "numerics": {"dx_mm": 5.0, "precision": "float64"},
        }
    )
