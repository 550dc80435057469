"""Moduli of a sphere pack, and the seat of its lowest grains, against single contacts."""

import numpy as np
import pytest
from known_cases.hertz import hertz_stiffness

from ajgdata.gripper.contact import (
    Latex,
    Pack,
    plane_modulus,
    seat,
)
from ajgdata.gripper.object_materials import MATERIALS, Material

PLASTIC = MATERIALS["plastic"]


def contact_modulus(one: Material, other: Material) -> float:
    """E* of two solids, Pa (Johnson 1985, eq. 4.6)."""
    return float(1 / sum(1 / plane_modulus(m.young_pa, m.poisson) for m in (one, other)))


def mindlin_ratio(poisson: float) -> float:
    """Tangential over normal stiffness of two like spheres that do not slip (Mindlin 1949)."""
    return 2 * (1 - poisson) / (2 - poisson)


def test_walton_is_the_mean_field_of_hertz_and_mindlin_contacts():
    # (1-φ) C F/(π d²) = P; K = (1-φ) C kₙ/(3π d), G = (1-φ) C (kₙ + 3/2 kₜ)/(5π d).
    pack, stress = Pack(6e-3, 0.40, PLASTIC, 5.3), 3_500.0
    filled = 0.6 * 5.3
    force = stress * np.pi * pack.diameter**2 / filled
    modulus = contact_modulus(PLASTIC, PLASTIC)
    normal = hertz_stiffness(force, pack.diameter / 4, modulus)
    bulk, rough = pack.moduli(stress)
    assert bulk == pytest.approx(filled * normal / (3 * np.pi * pack.diameter), rel=1e-12)
    sticking = normal * (1 + 1.5 * mindlin_ratio(PLASTIC.poisson))
    assert rough == pytest.approx(filled * sticking / (5 * np.pi * pack.diameter), rel=1e-12)


def test_without_latex_the_seat_is_hertz():
    # A uniform patch of Hertz's radius gives way by 32/(3π²) as much as Hertz's own pressure.
    pack, stress = Pack(6e-3, 0.40, PLASTIC), 3_500.0
    bare = seat(stress, pack, MATERIALS["steel"], Latex(thickness=0.0))
    modulus = contact_modulus(PLASTIC, MATERIALS["steel"])
    hertz = pack.seats_per_m2 * hertz_stiffness(stress / pack.seats_per_m2, 3e-3, modulus)
    assert bare.stiffness_n_m3 == pytest.approx(hertz * 3 * np.pi**2 / 32)
