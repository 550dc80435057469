"""Errors of the time step that remain after its dispersion is removed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.grid import cut_cells
from ajgdata.gripper.medium import Fluid, air_fluid
from ajgdata.gripper.solver import Probe, at_rest, march
from ajgdata.gripper.system import Packed, System, assemble
from ajgdata.gripper.walls import NO_WALLS, WallList
from ajgdata.studies.extreme_cases import AIR
from ajgdata.studies.known_cases.case import Identity
from ajgdata.studies.rigid_domains import box

Real = NDArray[np.floating]
Complex = NDArray[np.complexfloating]


class TimeStep(Identity):
    """Response of two cells of grains in a row, each with a wall, compared with a circuit.

    The simulated response is read at the frequencies to which the time step moves ω. It is then the
    exact response of a circuit in which, with κ = √(1 - (ωΔt/2)²) and γ = σ'/ρ∞,

    - the compressibility C∞ and the stiffness of a wall are unchanged,
    - the resistance of a wall is r/κ and its mass m/κ²,
    - each relaxation time is τ/κ,
    - the drag is σ'κ, and the density ρ∞ (γΔt/2) coth(γΔt/2), which is equal at all frequencies.

    So removing the dispersion is exact for the leapfrog. The remaining relative errors are (ωΔt)²/8
    of the resistances, drag and relaxation times, (ωΔt)²/4 of the mass of a wall, and (γΔt)²/12 of
    the density of the grains.
    """

    title = "what undoing the time step leaves of drag, relaxation and walls is what it must be"
    #: NumPy adds 16,000 terms in pairs: blocks of 128 terms in eight sums (15 roundings in a row,
    #: and 3 for the sum of the eight), then 7 levels of pairs.
    derived = "some 60 operations of a step and the circuit, and 25 of a sum in pairs: 89 ε"
    roundings = 64 + 25
    steps = 16_000
    h = 4e-3  #: grid spacing (m)
    dt = 1 / (4 * 44_100)  #: s
    #: Mass (kg/m²), resistance (Pa s/m) and stiffness (N/m³) of each wall. The second wall has no
    #: spring, so that the pressure returns to zero.
    walls = ((0.05, 300.0, 2e5), (0.0, 100.0, 0.0))
    fluid = Fluid(2.0, 8_000.0, 1e-5, (0.2, 0.1), (2e-4, 2e-5))
    hertz = np.geomspace(50, 20_000, 40)

    def deviation(self, quick: bool) -> float:
        """Return the largest difference of the pressures, relative to the larger at a frequency."""
        omega = 2 * np.pi * self.hertz
        simulated = self._simulated(omega)
        exact = circuit(self.fluid, self.walls, self.h, omega, self.dt)
        return float(np.max(np.abs(simulated - exact) / np.abs(exact).max(axis=0)))

    def _simulated(self, omega: Real) -> Complex:
        """Return the simulated pressures (2, ω) in both cells for a unit flow into the first.

        `sum` adds in pairs; the order of additions in a matrix product differs between CPUs.
        """
        system, probes = self._pair()
        warped = 2 * np.arcsin(omega * self.dt / 2)
        kernel = np.exp(-1j * warped[:, None] * np.arange(self.steps))
        drive = np.ones(1)
        waves = [
            march(system, at_rest(system), probes[0], probe, drive, self.steps) for probe in probes
        ]
        return np.array([np.exp(-0.5j * warped) * (kernel * wave).sum(axis=1) for wave in waves])

    def _pair(self) -> tuple[System, tuple[Probe, Probe]]:
        """Return a system of four equal columns of two cells, and probes for the layers of cells.

        Equal columns act as one column.
        """
        h = self.h
        cells = cut_cells(box(2 * h, 2 * h, 2 * h, 2 * h), h, 2 * h, 0.0, 2 * h)
        area = np.where(cells.volume > 0, h**2, 0.0)
        walls = sum((WallList.uniform(area, *wall) for wall in self.walls), start=NO_WALLS)
        grains = Packed(self.fluid, 0.4, np.ones(cells.shape))
        system = assemble(cells, air_fluid(AIR), self.dt, grains, walls)
        live = np.flatnonzero(system.mass.ravel() > 0)
        layers = np.split(live, 2)
        first, other = (Probe(c.astype(np.uint64), np.full(len(c), 1 / len(c))) for c in layers)
        return system, (first, other)


def circuit(
    fluid: Fluid,
    walls: Sequence[tuple[float, float, float]],
    h: float,
    omega: Real,
    dt: float = 0.0,
) -> Complex:
    """Return the pressures (2, ω) in two layers of cells for a flow of 1 m³/s into the first.

    Each layer has four cells of edge `h` (m), side by side. Each cell has `walls` of area h² with
    mass, resistance and stiffness per area (SI). With a time step `dt` (s), the parts of the
    circuit are those that `TimeStep` lists; without it, they are those of continuous time.
    """
    iw = 1j * omega
    kappa = np.sqrt(1 - (omega * dt / 2) ** 2)
    half = fluid.drag / fluid.density * dt / 2
    inertia = fluid.density * (half / np.tanh(half) if half else 1.0)
    relaxed = 1 + sum(
        c / (1 + iw * tau / kappa) for c, tau in zip(fluid.strengths, fluid.times, strict=True)
    )
    yields = sum(h**2 / (iw * m / kappa**2 + r / kappa + k / iw) for m, r, k in walls)
    cell = 4 * (iw * h**3 * fluid.compressibility * relaxed + yields)
    link = 4 * h / (fluid.drag * kappa + iw * inertia)
    whole = (cell + link) ** 2 - link**2
    return np.array([(cell + link) / whole, link / whole])
