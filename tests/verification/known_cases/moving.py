"""Modes that share cells with grains, walls and one another: energy and reciprocity."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.grid import cut_cells
from ajgdata.gripper.medium import air_fluid, fit_fluid
from ajgdata.gripper.solver import State, at_rest, march
from ajgdata.gripper.solver_plan import wide_weight
from ajgdata.gripper.system import Packed, System, assemble
from ajgdata.gripper.walls import ModeList, WallList
from ajgdata.studies.energy import energies, random_state
from ajgdata.studies.extreme_cases import AIR, PLASTIC, bowl_cells, time_step, two_probes
from ajgdata.studies.rigid_domains import box
from known_cases.case import Identity
from known_cases.identities import (
    EnergyConstant,
    EnergyNeverGrows,
)

Real = NDArray[np.floating]
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


def moving_bowl(modes: Real, lossy: bool) -> System:
    """The bowl with `modes` (N, 3) of m (kg), r (kg/s), k (N/m) on the cells where grains would be;
    grains and walls if `lossy`."""
    cells, weight = bowl_cells(H), wide_weight(H)
    grains = Packed(fit_fluid(PLASTIC, AIR), PLASTIC.porosity, np.ones(cells.shape))
    cell = np.flatnonzero(cells.bed)
    moved = np.random.default_rng(0).uniform(-1, 1, (len(modes), len(cell))) * H**2
    return assemble(
        cells,
        air_fluid(AIR),
        time_step(H, weight),
        grains if lossy else None,
        WallList.uniform(cells.membrane, 0.3, 450.0 * lossy, 1e5),
        modes=ModeList(cell, moved, *modes.T),
        wide=weight,
    )


def disturbed(system: System) -> State:
    """A random field, and modes each with a tenth of its energy, ½ m v²."""
    state = random_state(system)
    share = 0.1 * energies(system, random_state(system), 1)[0]
    state.motion[0] = 2 * np.sqrt(system.modes.inertia * share / system.dt)
    state.motion[2] = system.modes.weight @ state.p[system.modes.cell]
    return state


class EnergyConstantWithModes(EnergyConstant):
    """Four lossless modes, from massless to 1e6 kg, in a lossless cavity."""

    title = "energy is constant with lossless modes and walls"
    derived = "the inverse of the modes' matrix is rounded once, for all steps alike: steps ε"
    power = 1.0

    def struck(self) -> tuple[System, State]:
        """See EnergyConstant."""
        system = moving_bowl(LOSSLESS, lossy=False)
        return system, disturbed(system)


class EnergyNeverGrowsWithModes(EnergyNeverGrows):
    """Seven modes among grains and walls."""

    title = "energy never grows with modes among grains and walls"
    left = 0.9

    def struck(self) -> tuple[System, State]:
        """See EnergyNeverGrows."""
        system = moving_bowl(EXTREMES, lossy=True)
        return system, disturbed(system)


class StaticPressure(Identity):
    """A volume of air pushed in presses on air, grains, a sprung wall and a sprung mode at once."""

    title = "what a cavity settles at: p (V/γP + grains + S/k + W²/k) is the volume pushed in"
    derived = "what is held may be rounded in each step, all alike: steps ε"
    steps, height, width, h = 30_000, 0.032, 0.040, 4e-3
    roundings = steps
    wall = (0.3, 2e4, 1e7)
    mode = (1e-3, 30.0, 2e4)

    def deviation(self, quick: bool) -> float:
        """Return the relative error of the pressure at the end."""
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
        pressure = march(system, at_rest(system), source, receiver, slowly, self.steps)
        area = self.width**2
        dense = fluid.compressibility * (1 + sum(fluid.strengths))
        yielding = area * (bed * dense + (self.height - bed) * air.compressibility)
        yielding += area / self.wall[2] + area**2 / self.mode[2]
        return float(abs(pressure[-1] * yielding / dt - 1))
