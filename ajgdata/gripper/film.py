"""Air trapped between the membrane and the object that it lies on.

Two surfaces touch at their highest points; between them stays a film as thick as the rougher one's
points are high. Sound that presses the membrane compresses it: a spring 1/(hβ) per area between the
membrane and the object's skin. It cannot flow away: at 5 kHz air creeps √(h² P/12ηω) = 6 mm through
a film of 50 µm, within one cell.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ajgdata.gripper.contact import Spring
from ajgdata.gripper.medium import Air
from ajgdata.gripper.object_materials import GAP_UM, Material
from ajgdata.gripper.scene import Scene

#: Where a film's stiffness and loss are taken, the middle of the octaves in which it is felt.
FILM_HZ = 5_000.0
#: Mean gap of a material that is given by its numbers: nothing is said of its surface.
UNNAMED_UM = 0.0


class Skin(NamedTuple):
    """What meets the sound, per area: mass (kg/m²), resistance (Pa s/m), stiffness (N/m³)."""

    mass: float
    resistance: float
    stiffness: float


class Film(NamedTuple):
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
        share, rest = stiffness / below.stiffness, stiffness / self.spring.stiffness_n_m3
        mass = self.membrane_kg_m2 + (below.mass - self.membrane_kg_m2) * share**2
        lossy = self.spring.loss * rest * np.sqrt(stiffness * mass)
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
