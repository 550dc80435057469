"""Piston with mass, resistance and stiffness at the end of a tube, as a wall and as a mode."""

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
from ajgdata.studies.known_cases.case import Identity, Refinement
from ajgdata.studies.rigid_domains import box

Real = NDArray[np.floating]
Complex = NDArray[np.complexfloating]
#: Mass kg/m², resistance Pa s/m, stiffness N/m³.
Parameters = tuple[float, float, float]
LENGTH_M = 0.24
#: Length of a response (s).
TIME_S = 20e-3
#: Imaginary part α (1/s) of the frequencies ω - iα: it reduces the response after TIME_S to e^-20.
FADE = 1_000.0
#: Frequencies (rad/s) of the transfer functions.
OMEGA = 2 * np.pi * np.linspace(100, 3_000, 30) - 1j * FADE
#: Pistons by name. `styrofoam` is a plate of 10 mm, compressed along its thickness. `fast`
#: resonates at 50 MHz, far above the limit of the grids (90 kHz). `massless` is a spring that is
#: softer than the air of a cell.
PISTONS: dict[str, Parameters] = {
    "latex": (0.3, 450.0, 1e5),
    "styrofoam": (0.25, 671.0, 5e8),
    "massless": (0.0, 0.0, 3e6),
    "fast": (1e-9, 1e-3, 1e8),
}


def tube(h: float, piston: Parameters, as_mode: bool) -> tuple[Real, float, float]:
    """Return the pressure (n,) at the piston after a pulse of one step at the far end.

    The second and third values are Δt (s) and the cross-section (m²).
    """
    cells = cut_cells(box(2 * h, 2 * h, LENGTH_M, 0.0), h, 2 * h, 0.0, LENGTH_M)
    end, start = np.flatnonzero(cells.volume.any((1, 2)))[[0, -1]].tolist()
    area = np.where(np.arange(len(cells.z))[:, None, None] == end, cells.volume / h, 0.0)
    walls = WallList.uniform(area, *piston)
    modes = NO_MODES
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
    """Return the exact transfer function of a tube with a piston, (ω,) at OMEGA.

    It is the pressure (Pa) in the middle of the last cell per volume velocity per area (m/s) at the
    far end. With a piston of impedance Z, p = Z cos kx + i ρc sin kx up to a factor; u follows from
    Euler's equation.
    """
    mass, resistance, stiffness = piston
    k = OMEGA / AIR.sound_speed
    z0 = AIR.density * AIR.sound_speed
    impedance = 1j * OMEGA * mass + resistance + stiffness / (1j * OMEGA)
    inflow = (1j * impedance * np.sin(k * LENGTH_M) + z0 * np.cos(k * LENGTH_M)) / z0
    return np.asarray((impedance * np.cos(k * h / 2) + 1j * z0 * np.sin(k * h / 2)) / inflow)


@dataclass(eq=False)
class Piston(Refinement):
    """Transfer function of a tube with one of PISTONS at its end."""

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
        """Smallest order that passes; a soft piston has 1, as it acts on the centre of a cell."""
        return 1.0 if self.piston == "massless" else 1.8

    def error(self, h: float) -> float:
        """Return the relative L2 error from 100 Hz to 3 kHz."""
        sound, dt, area = tube(h, PISTONS[self.piston], as_mode=True)
        time = (np.arange(len(sound)) + 0.5) * dt
        measured = np.exp(-1j * OMEGA[:, None] * time) @ sound * area
        exact = transfer_function(h, PISTONS[self.piston])
        return float(np.linalg.norm(measured - exact) / np.linalg.norm(exact))

    def cap(self, h: float) -> float:
        """Return the largest error that passes; `derived` gives its derivation."""
        top = float(OMEGA[-1].real)
        k = top / AIR.sound_speed
        dispersion = top * (k * h) ** 2 / 24 / FADE
        if self.piston == "massless":
            return dispersion + k * h / 2
        return dispersion


class OnePiston(Identity):
    """Difference between a wall and a mode, which are two implementations of the same piston."""

    title = "locally reacting wall and mode are the same piston, for all four"
    derived = "sums in another order differ by an ulp a step, and nothing forgets: steps ε"
    h = 8e-3
    roundings = TIME_S / time_step(h)

    def deviation(self, quick: bool) -> float:
        """Return the largest difference of all pistons, relative to the largest pressure."""
        differences = []
        for piston in PISTONS.values():
            local, _, _ = tube(self.h, piston, as_mode=False)
            modal, _, _ = tube(self.h, piston, as_mode=True)
            differences.append(float(np.max(np.abs(local - modal)) / np.max(np.abs(local))))
        return max(differences)
