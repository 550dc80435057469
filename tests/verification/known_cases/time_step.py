"""What is left of the time step where its dispersion has been undone, part by part."""

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
from ajgdata.studies.rigid_domains import box
from known_cases.case import Identity

Real = NDArray[np.floating]
Complex = NDArray[np.complexfloating]


class TimeStep(Identity):
    """Two cells of grains in a row, each with a wall, heard at the frequencies that the time step
    makes of ω, answer as a circuit does in which, with κ = √(1 - (ωΔt/2)²) and γ = σ'/ρ∞,

    - the compressibility C∞ and the stiffness of a wall are what they are,
    - the resistance of a wall is r/κ and its mass m/κ²,
    - each relaxation time is τ/κ,
    - the drag is σ'κ, and the density ρ∞ (γΔt/2) coth(γΔt/2), the same at all frequencies.

    So undoing the dispersion is exact for the leapfrog, and what is left is (ωΔt)²/8 of the
    resistances, drag and times, (ωΔt)²/4 of a wall's mass, and (γΔt)²/12 of the grains' density.
    """

    title = "what undoing the time step leaves of drag, relaxation and walls is what it must be"
    #: NumPy adds 16,000 terms in pairs: blocks of 128 in eight sums (15 roundings in a row, 3 to
    #: join the sums), then 7 levels.
    derived = "some 60 operations of a step and the circuit, and 25 of a sum in pairs: 89 ε"
    roundings = 64 + 25
    steps, h, dt = 16_000, 4e-3, 1 / (4 * 44_100)
    #: The second lets out what was let in: with springs alone a pressure would stay.
    walls = ((0.05, 300.0, 2e5), (0.0, 100.0, 0.0))
    fluid = Fluid(2.0, 8_000.0, 1e-5, (0.2, 0.1), (2e-4, 2e-5))
    hertz = np.geomspace(50, 20_000, 40)

    def deviation(self, quick: bool) -> float:
        """Return the largest difference of the pressures, in units of the largest at its
        frequency."""
        omega = 2 * np.pi * self.hertz
        value, exact = self._marched(omega), circuit(self.fluid, self.walls, self.h, omega, self.dt)
        return float(np.max(np.abs(value - exact) / np.abs(exact).max(axis=0)))

    def _marched(self, omega: Real) -> Complex:
        """Pressures (2, ω) in both cells for a unit of flow into the first, from the marching.

        They are added in pairs: the order in which a matrix product adds differs by CPU.
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
        """Four columns of two cells each, alike, so that they are one; the cells of each layer."""
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
    """Return the pressures (2, ω) in two cells of edge `h` (m), four of each side by side, for one
    m³/s into the first; walls of area h² and mass, resistance, stiffness
    (SI) `walls` in each.

    With a `dt` (s) its parts are those that marching makes of them, see `TimeStep`.
    """
    iw, kappa = 1j * omega, np.sqrt(1 - (omega * dt / 2) ** 2)
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
