"""Energy and static pressure with modes that share cells with grains, walls and other modes."""

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
from ajgdata.studies.known_cases.case import Identity
from ajgdata.studies.known_cases.identities import (
    EnergyConstant,
    EnergyNeverGrows,
)
from ajgdata.studies.rigid_domains import box

Real = NDArray[np.floating]
#: Modal m (kg), r (kg/s), k (N/m) of extreme modes: massless; heavy; damped; stiff, with a
#: resonance far above the Nyquist frequency; free; only a resistance; all zero.
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
#: Lossless modes of `EXTREMES`: massless, heavy, stiff and free.
LOSSLESS = np.delete(EXTREMES[:5], 2, axis=0)
#: Grid spacing (m).
H = 4e-3


def moving_bowl(modes: Real, lossy: bool) -> System:
    """Return the bowl with modes on the cells of the bed.

    `modes` (N, 3) are m (kg), r (kg/s) and k (N/m). If the bowl is `lossy`, it has grains and
    resistive walls.
    """
    cells = bowl_cells(H)
    weight = wide_weight(H)
    resistance = 450.0 if lossy else 0.0
    grains = Packed(fit_fluid(PLASTIC, AIR), PLASTIC.porosity, np.ones(cells.shape))
    cell = np.flatnonzero(cells.bed)
    moved = np.random.default_rng(0).uniform(-1, 1, (len(modes), len(cell))) * H**2
    return assemble(
        cells,
        air_fluid(AIR),
        time_step(H, weight),
        grains if lossy else None,
        WallList.uniform(cells.membrane, 0.3, resistance, 1e5),
        modes=ModeList(cell, moved, *modes.T),
        wide=weight,
    )


def disturbed(system: System) -> State:
    """Return a random field, and modes that each have a tenth of its energy, ½ m v²."""
    state = random_state(system)
    share = 0.1 * energies(system, random_state(system), 1)[0]
    state.motion[0] = 2 * np.sqrt(system.modes.inertia * share / system.dt)
    state.motion[2] = system.modes.weight @ state.p[system.modes.cell]
    return state


class EnergyConstantWithModes(EnergyConstant):
    """Energy of four lossless modes, from massless to 1e6 kg, in a lossless cavity."""

    title = "energy is constant with lossless modes and walls"
    derived = "the inverse of the modes' matrix is rounded once, for all steps alike: steps ε"
    power = 1.0

    def start(self) -> tuple[System, State]:
        """Return a system and its state at the start."""
        system = moving_bowl(LOSSLESS, lossy=False)
        return system, disturbed(system)


class EnergyNeverGrowsWithModes(EnergyNeverGrows):
    """Energy of seven modes among grains and walls."""

    title = "energy never grows with modes among grains and walls"
    largest_final_share = 0.9

    def start(self) -> tuple[System, State]:
        """Return a system and its state at the start."""
        system = moving_bowl(EXTREMES, lossy=True)
        return system, disturbed(system)


class StaticPressure(Identity):
    """Final pressure after a volume of air is pushed into a cavity.

    The cavity has air, grains, and a wall and a mode with springs.
    """

    title = "what a cavity settles at: p (V/γP + grains + S/k + W²/k) is the volume pushed in"
    derived = "what is held may be rounded in each step, all alike: steps ε"
    steps = 30_000
    height = 0.032  #: m
    width = 0.040  #: m
    h = 4e-3  #: grid spacing (m)
    roundings = steps
    wall = (0.3, 2e4, 1e7)  #: kg/m², Pa s/m, N/m³
    mode = (1e-3, 30.0, 2e4)  #: kg, kg/s, N/m

    def deviation(self, quick: bool) -> float:
        """Return the relative error of the pressure at the end."""
        fluid = fit_fluid(PLASTIC, AIR)
        bed = self.height / 2
        cells = cut_cells(
            box(self.width, self.width, self.height, bed), self.h, 0.024, 0.0, self.height
        )
        end = int(np.flatnonzero(cells.volume.any((1, 2)))[0])
        floor = np.where(np.arange(len(cells.z))[:, None, None] == end, cells.volume / self.h, 0.0)
        walls = WallList.uniform(floor, *self.wall)
        modes = ModeList(walls.cell, walls.area[None, :], *np.array([self.mode]).T)
        grains = Packed(fluid, PLASTIC.porosity, np.ones(cells.shape))
        air = air_fluid(AIR)
        dt = time_step(self.h)
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
