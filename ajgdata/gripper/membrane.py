"""The membrane: held by the grains on it, and with a film of air under it on an object.

Two surfaces touch at their highest points; between them stays a film as thick as the rougher one's
points are high. Sound that presses the membrane compresses it: a spring 1/(hβ) per area between the
membrane and the object's skin. It cannot flow away: at 5 kHz air creeps √(h² P/12ηω) = 6 mm through
a film of 50 µm, within one cell.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss

from ajgdata.gripper.contact import GRAIN_SOLIDS, GRAVITY, LOOSEST_PA, Pack, Spring
from ajgdata.gripper.geometry import Cavity
from ajgdata.gripper.grid import Cells
from ajgdata.gripper.medium import Air
from ajgdata.gripper.objects import GAP_UM, MM, Material
from ajgdata.gripper.scene import Scene
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


def membrane_walls(scene: Scene, shape: Cavity, cells: Cells) -> WallList:
    """The membrane where it lies on nothing outside, as locally reacting walls.

    With grains it yields in the spans between them, and between their edge and the rim. The grains
    are held, by the grasp and by their weight (37 kg/m² of them, 0.3 of membrane). The tension is
    that of the given stiffness, the stress the weight of half the bed: it matters as its logarithm.
    """
    membrane, medium = scene.gripper.membrane, scene.medium
    mass, resistance = membrane.mass_kg_m2, membrane.resistance_pa_s_m
    if medium.kind == "air" or not membrane.pinned or not membrane.stiffness_n_m3:
        return WallList.uniform(cells.membrane, mass, resistance, membrane.stiffness_n_m3)
    pack = Pack(medium.grain_diameter_mm * MM, medium.porosity, GRAIN_SOLIDS[medium.kind])
    weight = pack.density * scene.gripper.bed_depth_mm * MM
    tension = scene.gripper.tension_n_m
    span = pinned(GRAVITY * weight / 2, pack, tension, mass)
    between = shape.bare_edge(scene.gripper.rim_radius_mm * MM)
    edge = strip(max(between.width_m, pack.diameter), tension, mass)
    bare = cells.membrane - cells.covered
    if bare.any():
        bare *= between.area_m2 / bare.sum()  # counted cells miss or add a few per cent of it
    return WallList.uniform(
        cells.covered, span.mass_kg_m2, resistance, span.stiffness_n_m3
    ) + WallList.uniform(bare, edge.mass_kg_m2, resistance, edge.stiffness_n_m3)


#: Where a film's stiffness and loss are taken, the middle of the octaves in which it is felt.
FILM_HZ = 5_000.0
#: Mean gap of a material that is given by its numbers: nothing is said of its surface.
UNNAMED_UM = 0.0


class Skin(NamedTuple):
    """What meets the sound, per area: mass (kg/m²), resistance (Pa s/m), stiffness (N/m³)."""

    mass: float
    resistance: float
    stiffness: float


class AirFilm(NamedTuple):
    """A film of air of some thickness (m), its spring, and the membrane over it (kg/m²)."""

    thickness: float
    spring: Spring
    membrane_kg_m2: float

    def over(self, skin: Skin | None) -> Skin:
        """Return `skin`, which has the membrane's mass on it, with the film between the two; None:
        nothing below the film gives way.

        One degree of freedom, the membrane's: the springs are in series, and the skin's own mass
        and resistance move with the share that it has of the give (Rayleigh).
        """
        below = Skin(self.membrane_kg_m2, 0.0, np.inf) if skin is None else skin
        stiffness = 1 / (1 / below.stiffness + 1 / self.spring.stiffness_n_m3)
        share, spring_share = stiffness / below.stiffness, stiffness / self.spring.stiffness_n_m3
        mass = self.membrane_kg_m2 + (below.mass - self.membrane_kg_m2) * share**2
        lossy = self.spring.loss * spring_share * np.sqrt(stiffness * mass)
        return Skin(mass, below.resistance * share**2 + float(lossy), stiffness)


def film_spring(thickness: float, air: Air, frequency_hz: float = FILM_HZ) -> Spring:
    """Return the spring per area of a film of `thickness` (m) at `frequency_hz`.

    Its compressibility is β = (1 + (γ-1) tanh(z)/z)/(γP), z = (h/2)√(iωρ Pr/η): isothermal, 1/P, if
    thin, adiabatic, 1/(γP), if thick (Zwikker & Kosten 1949; Stinson, JASA 89, 1991, 550, for a
    slit); the heat that it hands to both surfaces in between is its loss.
    """
    omega = 2 * np.pi * frequency_hz
    z = thickness / 2 * np.sqrt(1j * omega * air.density * air.prandtl / air.viscosity)
    yields = (1 + (air.gamma - 1) * np.tanh(z) / z) * air.compressibility * thickness
    stiffness = 1 / yields
    return Spring(float(stiffness.real), float(stiffness.imag / stiffness.real))


def gap_m(scene: Scene) -> float:
    """Mean gap (m) between membrane and object: of its material, times the membrane's `film`."""
    thing = scene.object
    if thing is None or thing.material == "rigid":
        return 0.0
    if thing.gap_um is not None:
        return thing.gap_um * 1e-6
    if isinstance(thing.material, Material):
        return UNNAMED_UM * 1e-6
    low, high = GAP_UM[thing.material]
    return float(np.sqrt(low * high)) * 1e-6 * scene.gripper.membrane.film
