"""Resonances of boxes, whose exact values are known, with walls on the grid and off the grid."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.solver_plan import wide_weight
from ajgdata.gripper.system import System
from ajgdata.studies.extreme_cases import AIR
from ajgdata.studies.known_cases.case import Refinement
from ajgdata.studies.rigid_domains import box, closed, frequencies

Real = NDArray[np.floating]
#: Edges (m) of the box.
BOX = (0.120, 0.100, 0.080)
#: Courant number of the time step.
COURANT = 0.99


def box_modes(edges: tuple[float, ...], highest: float) -> Real:
    """Return the resonances (Hz), (N,), of a rigid box below `highest` (Hz), in ascending order.

    `edges` are in m. The static mode is not included.
    """
    orders = np.stack(np.meshgrid(*[np.arange(12)] * 3), -1).reshape(-1, 3)
    modes = np.sort(AIR.sound_speed / 2 * np.sqrt(((orders / edges) ** 2).sum(1)))[1:]
    return modes[modes < highest]


def largest_error(system: System, exact: Real) -> float:
    """Return the largest relative error of the lowest resonances.

    `exact` (N,) are their exact values (Hz). The dispersion of the time steps is removed, as
    it is from every response.
    """
    lowest = frequencies(system, len(exact), steps_exact=True)
    return float(np.max(np.abs(lowest / exact - 1)))


class BoxOnGrid(Refinement):
    """Resonances of a box of 120 × 100 × 80 mm whose walls are on faces of the grid."""

    title = "resonances of a box below 3 kHz, walls on the grid"
    derived = "numerical dispersion of a wave along an axis: of four weights"
    sizes: ClassVar[tuple[float, ...]] = (5e-3, 4e-3, 10e-3 / 3, 2.5e-3, 2e-3)
    quick_sizes: ClassVar[tuple[float, ...]] = (20e-3 / 3, 5e-3)
    highest = 3_000.0
    least_order = 3.8  #: the scheme is of fourth order; five grids determine it to about 0.2

    def error(self, h: float) -> float:
        """Return the largest relative error of a resonance."""
        exact = box_modes(BOX, self.highest)
        _, system = closed(box(*BOX), h, 0.061, 0.0, BOX[2], COURANT)
        return largest_error(system, exact)

    def cap(self, h: float) -> float:
        """Return the largest error that passes; `derived` gives its derivation."""
        weight = wide_weight(h)
        phase = 2 * np.pi * self.highest / AIR.sound_speed * h
        seen = 2 * (1 + 3 * weight) * np.sin(phase / 2) - 2 * weight * np.sin(3 * phase / 2)
        return float(abs(seen / phase - 1))


class BoxOffGrid(BoxOnGrid):
    """Resonances of a slightly lower box, turned by 20°, whose walls cut cells in many ways."""

    title = "resonances of a box below 3 kHz, walls cutting cells"
    derived = "the bound that a prototype of the scheme kept, set beforehand"
    sizes = (10e-3, 8e-3, 6e-3, 4.9e-3, 4e-3, 3.3e-3)
    quick_sizes = (10e-3, 6e-3, 4e-3)
    least_order = 0.9
    edges = (0.120, 0.100, 0.0783)

    def error(self, h: float) -> float:
        """Return the largest relative error of a resonance."""
        exact = box_modes(self.edges, self.highest)
        turned = box(*self.edges, turn=np.deg2rad(20))
        _, system = closed(turned, h, 0.08, 0.0, self.edges[2], COURANT)
        return largest_error(system, exact)

    def cap(self, h: float) -> float:
        """Return the largest error that passes; `derived` gives its derivation."""
        return 6e-3
