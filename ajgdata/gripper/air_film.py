"""The film of air between the membrane and the object.

Two surfaces touch at their highest points, and a film of air remains between them. Its thickness is
about the height of the points of the rougher surface. Sound that presses the membrane compresses
the film: a spring 1/(hβ) per area between the membrane and the object's skin. The air cannot flow
away: at 5 kHz, it moves by √(h² P/12ηω) = 6 mm through a film of 50 µm, which is within one cell.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ajgdata.gripper.column import Skin
from ajgdata.gripper.contact import Spring
from ajgdata.gripper.medium import Air
from ajgdata.gripper.objects import GAP_UM, Material
from ajgdata.gripper.scene import Scene

#: Frequency at which stiffness and loss are computed: the middle of the octaves in which the film
#: has an effect.
FILM_HZ = 5_000.0
#: Mean gap (µm) of a material that is given by its numbers, because its surface is unknown.
UNNAMED_UM = 0.0


class AirFilm(NamedTuple):
    """A film of air: its thickness (m), its spring, and the mass of the membrane (kg/m²) on it."""

    thickness: float
    spring: Spring
    membrane_kg_m2: float

    def over(self, skin: Skin | None) -> Skin:
        """Return the skin with the film between it and the membrane.

        The mass of `skin` includes that of the membrane; None is a rigid skin. The result has one
        degree of freedom, the motion of the membrane. The springs are in series. Mass and
        resistance of the skin move with its share of the total displacement (Rayleigh).
        """
        below = Skin(self.membrane_kg_m2, 0.0, np.inf) if skin is None else skin
        stiffness = 1 / (1 / below.stiffness + 1 / self.spring.stiffness_n_m3)
        share = stiffness / below.stiffness
        film_share = stiffness / self.spring.stiffness_n_m3
        mass = self.membrane_kg_m2 + (below.mass - self.membrane_kg_m2) * share**2
        film_resistance = self.spring.loss * film_share * np.sqrt(stiffness * mass)
        return Skin(mass, below.resistance * share**2 + float(film_resistance), stiffness)


def film_spring(thickness: float, air: Air, frequency_hz: float = FILM_HZ) -> Spring:
    """Return the spring per area of a film of `thickness` (m) at `frequency_hz`.

    Its compressibility is β = (1 + (γ-1) tanh(z)/z)/(γP) with z = (h/2)√(iωρ Pr/η): isothermal,
    1/P, in a thin film, and adiabatic, 1/(γP), in a thick one (Zwikker & Kosten 1949; Stinson, JASA
    89, 1991, 550, for a slit). Between these limits, the heat that flows to both surfaces is the
    loss.
    """
    omega = 2 * np.pi * frequency_hz
    z = thickness / 2 * np.sqrt(1j * omega * air.density * air.prandtl / air.viscosity)
    flexibility = (1 + (air.gamma - 1) * np.tanh(z) / z) * air.compressibility * thickness
    stiffness = 1 / flexibility
    return Spring(float(stiffness.real), float(stiffness.imag / stiffness.real))


def gap_m(scene: Scene) -> float:
    """Return the mean gap (m) between membrane and object; 0 without a soft object.

    It is that of the object, or the geometric mean of the range of its material times the setting
    `film` of the membrane.
    """
    shape = scene.object
    if shape is None or shape.material == "rigid":
        return 0.0
    if shape.gap_um is not None:
        return shape.gap_um * 1e-6
    if isinstance(shape.material, Material):
        return UNNAMED_UM * 1e-6
    low, high = GAP_UM[shape.material]
    return float(np.sqrt(low * high)) * 1e-6 * scene.gripper.membrane.film
