"""A piston of any mass, resistance and stiffness at the end of a tube, as a wall and as a mode."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.grid import cut_cells
from ajgdata.gripper.medium import air_fluid
from ajgdata.gripper.solver import Probe, at_rest, march
from ajgdata.gripper.system import assemble
from ajgdata.gripper.walls import NO_MODES, NO_WALLS, ModeList, WallList
from ajgdata.studies.extreme_cases import AIR, time_step
from ajgdata.studies.rigid_domains import box
from known_cases.case import Identity, Refinement

Real = NDArray[np.floating]
Complex = NDArray[np.complexfloating]
#: Mass kg/m², resistance Pa s/m, stiffness N/m³.
Parameters = tuple[float, float, float]
LENGTH_M = 0.24
#: Transfer functions are taken at ω - iα: what is left of the response after TIME_S is e^-20.
TIME_S, FADE = 20e-3, 1_000.0
OMEGA = 2 * np.pi * np.linspace(100, 3_000, 30) - 1j * FADE


#: `styrofoam` is a plate of 10 mm that yields along its thickness; `fast` resonates at 50 MHz, on
#: grids that end at 90 kHz; `massless` is a spring softer than the air of a cell.
PISTONS: dict[str, Parameters] = {
    "latex": (0.3, 450.0, 1e5),
    "styrofoam": (0.25, 671.0, 5e8),
    "massless": (0.0, 0.0, 3e6),
    "fast": (1e-9, 1e-3, 1e8),
}


def tube(h: float, piston: Parameters, as_mode: bool) -> tuple[Real, float, float]:
    """Pressure (n,) beside the piston after a pulse of one step at the far end; Δt (s) and
    cross-section (m²)."""
    cells = cut_cells(box(2 * h, 2 * h, LENGTH_M, 0.0), h, 2 * h, 0.0, LENGTH_M)
    end, start = np.flatnonzero(cells.volume.any((1, 2)))[[0, -1]].tolist()
    area = np.where(np.arange(len(cells.z))[:, None, None] == end, cells.volume / h, 0.0)
    walls, modes = WallList.uniform(area, *piston), NO_MODES
    if as_mode:
        modal = [np.array([area.sum() * value]) for value in piston]
        modes = ModeList(walls.cell, walls.area[None, :], *modal)
        walls = NO_WALLS
    system = assemble(cells, air_fluid(AIR), time_step(h), walls=walls, modes=modes)
    live = np.flatnonzero((cells.volume > 0).ravel())
    ends = [live[live // system.span.slab == k] for k in (end, start)]
    near, far = (Probe(c.astype(np.uint64), np.full(len(c), 1 / len(c))) for c in ends)
    sound = march(system, at_rest(system), far, near, np.ones(1), int(TIME_S / system.dt))
    return sound, system.dt, float(area.sum())


def transfer_function(h: float, piston: Parameters) -> Complex:
    """Pressure (Pa) in the middle of the last cell per volume velocity per area (m/s) at the far
    end, (ω,) at OMEGA.

    p = Z cos kx + i ρc sin kx up to a factor, for a piston of impedance Z; u by Euler's equation.
    """
    mass, resistance, stiffness = piston
    k, z0 = OMEGA / AIR.sound_speed, AIR.density * AIR.sound_speed
    impedance = 1j * OMEGA * mass + resistance + stiffness / (1j * OMEGA)
    inflow = (1j * impedance * np.sin(k * LENGTH_M) + z0 * np.cos(k * LENGTH_M)) / z0
    return np.asarray((impedance * np.cos(k * h / 2) + 1j * z0 * np.sin(k * h / 2)) / inflow)


@dataclass(eq=False)
class Piston(Refinement):
    """Its transfer function, for one of PISTONS."""

    title = "transfer function from the far end of a tube"
    derived = (
        "dispersion (k h)²/24 of the frequency, over the damping of the resonance; for a soft "
        "piston also k h/2, as it acts on the cell's centre"
    )
    sizes = (12e-3, 8e-3, 6e-3, 4e-3, 2e-3)
    quick_sizes = (12e-3, 8e-3, 6e-3)
    piston: str

    @property
    def least_order(self) -> float:
        """A soft piston acts on the centre of its cell, which costs an order."""
        return 1.0 if self.piston == "massless" else 1.8

    def error(self, h: float) -> float:
        """Return the relative L2 error over 100 Hz-3 kHz."""
        sound, dt, area = tube(h, PISTONS[self.piston], as_mode=True)
        time = (np.arange(len(sound)) + 0.5) * dt
        measured = np.exp(-1j * OMEGA[:, None] * time) @ sound * area
        exact = transfer_function(h, PISTONS[self.piston])
        return float(np.linalg.norm(measured - exact) / np.linalg.norm(exact))

    def cap(self, h: float) -> float:
        """See `derived`."""
        top = float(OMEGA[-1].real)
        k = top / AIR.sound_speed
        return top * (k * h) ** 2 / 24 / FADE + (self.piston == "massless") * k * h / 2


class OnePiston(Identity):
    """A wall and a mode are two implementations of the same piston."""

    title = "locally reacting wall and mode are the same piston, for all four"
    derived = "sums in another order differ by an ulp a step, and nothing forgets: steps ε"
    h = 8e-3
    roundings = TIME_S / time_step(h)

    def deviation(self, quick: bool) -> float:
        """Return the largest difference over the largest pressure, of all pistons."""
        differences = []
        for piston in PISTONS.values():
            local, modal = (tube(self.h, piston, as_mode)[0] for as_mode in (False, True))
            differences.append(float(np.max(np.abs(local - modal)) / np.max(np.abs(local))))
        return max(differences)
