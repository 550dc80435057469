"""The membrane between its supports: it moves in the spans between grains, and along the rim."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss

from ajgdata.gripper.contact import GRAIN_SOLIDS, GRAVITY, LOOSEST_PA, Pack
from ajgdata.gripper.geometry import Cavity
from ajgdata.gripper.grid import Cells
from ajgdata.gripper.objects import MM
from ajgdata.gripper.scene import Scene
from ajgdata.gripper.walls import WallList


class MembraneSpan(NamedTuple):
    """A span of the membrane between its supports: mass and stiffness per area of its mean motion
    (kg/m², N/m³)."""

    mass_kg_m2: float
    stiffness_n_m3: float


def membrane_walls(scene: Scene, cavity: Cavity, cells: Cells) -> WallList:
    """Return the membrane where it touches neither object nor table, as locally reacting walls.

    With grains, it yields in the spans between them, and in the span between their edge and the
    rim. The grains do not move: the grasp holds them, and so does their weight (37 kg/m², and 0.3
    of the membrane). The tension follows from the stiffness of the membrane. The stress is the
    weight of half the bed; its logarithm determines the stiffness of a span.
    """
    membrane = scene.gripper.membrane
    medium = scene.medium
    mass = membrane.mass_kg_m2
    resistance = membrane.resistance_pa_s_m
    if medium.kind == "air" or not membrane.pinned or not membrane.stiffness_n_m3:
        return WallList.uniform(cells.membrane, mass, resistance, membrane.stiffness_n_m3)
    pack = Pack(medium.grain_diameter_mm * MM, medium.porosity, GRAIN_SOLIDS[medium.kind])
    bed_kg_m2 = pack.density * scene.gripper.bed_depth_mm * MM
    tension = scene.gripper.tension_n_m
    span = pinned(GRAVITY * bed_kg_m2 / 2, pack, tension, mass)
    bare_edge = cavity.bare_edge(scene.gripper.rim_radius_mm * MM)
    edge = strip(max(bare_edge.width_m, pack.diameter), tension, mass)
    bare = cells.membrane - cells.covered
    if bare.any():
        bare *= bare_edge.area_m2 / bare.sum()  # the area in cells differs by a few per cent
    under_grains = WallList.uniform(cells.covered, span.mass_kg_m2, resistance, span.stiffness_n_m3)
    return under_grains + WallList.uniform(bare, edge.mass_kg_m2, resistance, edge.stiffness_n_m3)


def pinned(stress: float, pack: Pack, tension: float, mass_kg_m2: float) -> MembraneSpan:
    """Return the spans of a membrane of `tension` (N/m) that each grain holds at one spot.

    The grains are under `stress` (Pa). Each grain is in a cell of radius R with πR² = 1/seats. The
    membrane wraps a patch of radius b of the grain, whose radius is r: 2πb T b/r is the force on
    the grain. Outside the patch, T∇²w = -p with w(b) = 0 and, by symmetry, w'(R) = 0 (as in
    Kuwabara, J. Phys. Soc. Japan 14, 1959, for flow). The solution is w = p/4T (2R² ln(x/b) - x²
    + b²). The result is its mean over the cell, with the mass of this shape (Rayleigh).
    """
    outer = 1 / np.sqrt(np.pi * pack.seats_per_m2)
    force = max(stress, LOOSEST_PA) / pack.seats_per_m2
    inner = min(np.sqrt(force * pack.diameter / 2 / (2 * np.pi * tension)), 0.9 * outer)
    nodes, weights = leggauss(24)
    x = inner + (outer - inner) * (nodes + 1) / 2
    share = weights / 2 * (outer - inner) * 2 * x / outer**2
    sag = (2 * outer**2 * np.log(x / inner) - x**2 + inner**2) / (4 * tension)
    mean = float(share @ sag)
    return MembraneSpan(mass_kg_m2 * float(share @ sag**2) / mean**2, 1 / mean)


def strip(width: float, tension: float, mass_kg_m2: float) -> MembraneSpan:
    """Return the span of a membrane between two lines at a distance of `width` (m).

    As in `pinned`, T w'' = -p, so w = p/2T x(width - x).
    """
    return MembraneSpan(1.2 * mass_kg_m2, 12 * tension / width**2)
