"""The membrane with grains on it: held by every grain and by the rim, free only in between."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss

from ajgdata.gripper.contact import GRAIN_SOLIDS, GRAVITY, LOOSEST_PA, Pack
from ajgdata.gripper.grid import Cells
from ajgdata.gripper.scene import Scene
from ajgdata.gripper.scene_model import MM
from ajgdata.gripper.walls import WallList


class MembraneSpan(NamedTuple):
    """Membrane between what holds it, per area: what its mean motion weighs (kg/m²) and the
    stiffness against it (N/m³)."""

    mass_kg_m2: float
    stiffness_n_m3: float


def pinned(stress: float, pack: Pack, tension: float, mass_kg_m2: float) -> MembraneSpan:
    """A membrane of `tension` (N/m) that grains under `stress` (Pa) hold fast in one spot each.

    Around each grain lies a cell of radius R, πR² = 1/seats, of which the grain wraps a patch of
    radius b: 2πb T b/r = its force, r its radius. Between, T∇²w = -p with w(b) = 0 and, by
    symmetry, w'(R) = 0 (as in Kuwabara, J. Phys. Soc. Japan 14, 1959, for flow):
    w = p/4T (2R² ln(x/b) - x² + b²), here averaged over the cell; the mass is that of the same
    shape (Rayleigh).
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
    """A membrane held along two lines `width` (m) apart: w = p/2T x(width - x), as in `pinned`."""
    return MembraneSpan(1.2 * mass_kg_m2, 12 * tension / width**2)


def membrane_walls(scene: Scene, cells: Cells) -> WallList:
    """The membrane where it lies on nothing outside, as locally reacting walls.

    With grains it yields in the spans between them, and between their edge and the rim. The grains
    are held, by the grasp and by their weight (37 kg/m² of them, 0.3 of membrane). The tension is
    that of the given stiffness, the stress the weight of half the bed: it matters as its logarithm.
    """
    membrane, medium = scene.gripper.membrane, scene.medium
    mass, resistance = membrane.mass_kg_m2, membrane.resistance_pa_s_m
    if medium.kind == "air" or not membrane.pinned or not membrane.stiffness_n_m3:
        return WallList.uniform(cells.membrane, mass, resistance, membrane.stiffness_n_m3)
    covered = np.divide(cells.bed, cells.volume, out=np.zeros(cells.shape), where=cells.volume > 0)
    under, over = cells.membrane * covered, cells.membrane * (1 - covered)
    pack = Pack(medium.grain_diameter_mm * MM, medium.porosity, GRAIN_SOLIDS[medium.kind])
    weight, rim = pack.density * scene.gripper.bed_depth_mm * MM, scene.gripper.rim_radius_mm * MM
    tension = scene.gripper.tension_n_m
    span = pinned(GRAVITY * weight / 2, pack, tension, mass)
    edge = strip(max(float(over.sum()) / (2 * np.pi * rim), pack.diameter), tension, mass)
    return WallList.uniform(
        under, span.mass_kg_m2, resistance, span.stiffness_n_m3
    ) + WallList.uniform(over, edge.mass_kg_m2, resistance, edge.stiffness_n_m3)
