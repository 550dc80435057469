"""Modes that share cells with grains, walls and one another: energy and reciprocity."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.grid import cut_cells
from ajgdata.gripper.medium import air_fluid, fit_fluid
from ajgdata.gripper.modes import ModeList
from ajgdata.gripper.solver import Probe, State, at_rest, march
from ajgdata.gripper.system import Packed, System, assemble
from ajgdata.gripper.walls import WallList
from ajgdata.studies.discrete_operator import energies
from ajgdata.studies.domains import (
    AIR,
    BOWL,
    PLASTIC,
    bowl,
    box,
    random_state,
    time_step,
    two_probes,
)
from ajgdata.studies.verification.case import Identity

Real = NDArray[np.floating]
EPS = float(np.finfo(float).eps)
#: Modal m (kg), r (kg/s), k (N/m): massless, heavy, soft, stiff and resonant far above Nyquist,
#: free; then a mere resistance, and nothing at all.
EXTREMES = np.array(
    [
        (0.0, 0.0, 1e3),
        (1e6, 0.0, 0.0),
        (1e-2, 1.0, 1e5),
        (1e-9, 0.0, 1e15),
        (1e-3, 0.0, 0.0),
        (0.0, 1e4, 0.0),
        (0.0, 0.0, 0.0),
    ]
)
LOSSLESS = np.delete(EXTREMES[:5], 2, axis=0)
H = 4e-3


def moving_bowl(modes: Real, lossy: bool, h: float = H) -> System:
    """The bowl with `modes` on the cells where grains would be; grains and walls if `lossy`."""
    cells = cut_cells(bowl(), h, *BOWL)
    grains = Packed(fit_fluid(PLASTIC, AIR), PLASTIC.porosity, np.ones(cells.shape))
    cell = np.flatnonzero(cells.bed)
    weight = np.random.default_rng(0).uniform(-1, 1, (len(modes), len(cell))) * h**2
    walls = WallList.uniform(cells.membrane, 0.3, 450.0 * lossy, 1e5)
    return assemble(
        cells,
        air_fluid(AIR),
        time_step(h),
        grains if lossy else None,
        walls,
        modes=ModeList(cell, weight, *modes.T),
    )


def disturbed(system: System) -> State:
    """A random field, and modes each with a tenth of its energy, ½ m v²."""
    state = random_state(system)
    share = 0.1 * energies(system, random_state(system), 1)[0]
    state.motion[0] = 2 * np.sqrt(system.modes.inertia * share / system.dt)
    state.motion[2] = system.modes.weight @ state.p[system.modes.cell]
    return state


class EnergyConstantWithModes(Identity):
    """Four lossless modes, from massless to 1e6 kg, in a lossless cavity."""

    title = "energy is constant with lossless modes and walls"
    derived = "the inverse of the modes' matrix is rounded once, for all steps alike: steps ε"

    def deviation(self, quick: bool) -> float:
        """Largest less smallest energy over the first."""
        system = moving_bowl(LOSSLESS, lossy=False)
        energy = energies(system, disturbed(system), self._steps(quick))
        return float(np.ptp(energy) / energy[0])

    def cap(self, quick: bool) -> float:
        """See `derived`."""
        return self._steps(quick) * EPS

    def _steps(self, quick: bool) -> int:
        return 500 if quick else 2_000


class EnergyNeverGrowsWithModes(Identity):
    """Seven modes among grains and walls."""

    title = "energy never grows with modes among grains and walls"
    derived = "the roundings of one step, all alike: 4 ε of the energy"

    def deviation(self, quick: bool) -> float:
        """Largest growth in a step, relative to the energy before it."""
        system = moving_bowl(EXTREMES, lossy=True)
        energy = energies(system, disturbed(system), 300 if quick else 2_000)
        if not 0 < energy[-1] < 0.9 * energy[0]:
            return np.inf  # it must dissipate, or the claim is empty
        return float(max(0.0, np.max(np.diff(energy) / energy[:-1])))

    def cap(self, quick: bool) -> float:
        """See `derived`."""
        return 4 * EPS


class ReciprocityWithModes(Identity):
    """Though an object moves between them."""

    title = "speaker and microphone may change places though something moves"
    derived = "one rounding a step, at random: √steps ε, of the largest pressure"
    steps = 800

    def deviation(self, quick: bool) -> float:
        """Largest difference over the largest pressure."""
        ends = two_probes(moving_bowl(EXTREMES, lossy=True))
        there, back = (self._heard(EXTREMES, pair) for pair in (ends, ends[::-1]))
        still = self._heard(EXTREMES[1:2], ends)
        peak = float(np.max(np.abs(there)))
        if np.max(np.abs(there - still)) < 1e-3 * peak:
            return np.inf  # what moves must be heard, or the claim is empty
        return float(np.max(np.abs(there - back)) / peak)

    def _heard(self, modes: Real, ends: tuple[Probe, Probe]) -> Real:
        system = moving_bowl(modes, lossy=True)
        return march(system, at_rest(system), ends[0], ends[1], np.ones(1), self.steps)

    def cap(self, quick: bool) -> float:
        """See `derived`."""
        return self.steps**0.5 * EPS


class StaticPressure(Identity):
    """A volume of air pushed in presses on air, grains, a sprung wall and a sprung mode at once."""

    title = "what a cavity settles at: p (V/γP + grains + S/k + W²/k) is the volume pushed in"
    derived = "what is held may be rounded in each step, all alike: steps ε"
    steps, height, width, h = 30_000, 0.032, 0.040, 4e-3
    wall = (0.3, 2e4, 1e7)
    mode = (1e-3, 30.0, 2e4)

    def deviation(self, quick: bool) -> float:
        """Relative error of the pressure at the end."""
        fluid, bed = fit_fluid(PLASTIC, AIR), self.height / 2
        cells = cut_cells(
            box(self.width, self.width, self.height, bed), self.h, 0.024, 0.0, self.height
        )
        end = int(np.flatnonzero(cells.volume.any((1, 2)))[0])
        floor = np.where(np.arange(len(cells.z))[:, None, None] == end, cells.volume / self.h, 0.0)
        walls = WallList.uniform(floor, *self.wall)
        modes = ModeList(walls.cell, walls.area[None, :], *np.array([self.mode]).T)
        grains = Packed(fluid, PLASTIC.porosity, np.ones(cells.shape))
        air, dt = air_fluid(AIR), time_step(self.h)
        system = assemble(cells, air, dt, grains, walls, modes=modes)
        source, receiver = two_probes(system)
        slowly = np.exp(-((np.arange(-800, 801) / 100) ** 2) / 2)
        slowly /= slowly.sum()
        heard = march(system, at_rest(system), source, receiver, slowly, self.steps)
        area = self.width**2
        dense = fluid.compressibility * (1 + sum(fluid.strengths))
        yielding = area * (bed * dense + (self.height - bed) * air.compressibility)
        yielding += area / self.wall[2] + area**2 / self.mode[2]
        return float(abs(heard[-1] * yielding / dt - 1))

    def cap(self, quick: bool) -> float:
        """See `derived`."""
        return self.steps * EPS
