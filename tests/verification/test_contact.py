"""Contacts of grains, pack and membrane against Hertz, Love, Walton and closed forms."""

import numpy as np
import pytest
from scipy.integrate import quad

from ajgdata.gripper.contact import (
    Latex,
    Pack,
    layer_approach,
    layer_stiffness,
    plane_modulus,
    seat,
    spread_compliance,
)
from ajgdata.gripper.membrane import pinned, strip
from ajgdata.gripper.objects import MATERIALS, Material

PLASTIC = MATERIALS["plastic"]
PACK = Pack(6e-3, 0.40, PLASTIC)
TENSION = 43.0
MASS = 0.3


def hertz_stiffness(force: float, radius: float, modulus: float) -> float:
    """(6 E*² R F)^(1/3), N/m, of a sphere on a half-space (Johnson 1985, eq. 4.23)."""
    return np.cbrt(6 * modulus**2 * radius * force)


def test_a_thick_layer_is_a_half_space_and_a_thin_one_a_squeezed_film():
    force = 0.1
    radius = 3e-3
    young = 1.5e6
    half_space = hertz_stiffness(force, radius, plane_modulus(young, 0.5))
    for thickness, tolerance in ((1.0, 1e-3), (10.0, 1e-4)):
        # χ = √(Rδ)/h is 6e-4 and 6e-5 here, and the first correction 1.133 χ times 4/3 or less.
        stiffness = layer_stiffness(force, radius, thickness, young)
        assert stiffness == pytest.approx(half_space, rel=tolerance)
    stiffnesses = [layer_stiffness(force, radius, h, young) for h in (1e-3, 5e-4, 3e-4, 2e-4)]
    assert np.all(np.diff(stiffnesses) > 0)
    # A bonded film that keeps its volume: ∇²p = -12 G (δ - r²/2R)/h³ with p = p' = 0 at the edge
    # gives F = 8π G R² δ³/h³. Leading order in h/a, and at χ = 1 the contact is four films wide.
    thickness = 0.3e-3
    approach = thickness**2 / radius
    film = 8 * np.pi * young / 3 * radius**2 * approach**3 / thickness**3
    assert layer_approach(film, radius, thickness, young) == pytest.approx(approach, rel=0.05)


def test_a_disc_of_pressure_sinks_by_loves_mean():
    # Mean of 1/(π E* r) over pairs of points in a disc, by the density of their distance r.
    def density_over_distance(r: float) -> float:
        return 4 / np.pi * (np.arccos(r / 2) - r / 2 * np.sqrt(1 - r * r / 4))

    mean_inverse = quad(density_over_distance, 0, 2)[0]
    modulus = 3e9
    radius = 2e-4
    assert spread_compliance(modulus, radius) == pytest.approx(
        mean_inverse / (np.pi * modulus * radius), rel=1e-9
    )


def contact_modulus(solid: Material, other: Material) -> float:
    """E* of two solids, Pa (Johnson 1985, eq. 4.6)."""
    return float(1 / sum(1 / plane_modulus(m.young_pa, m.poisson) for m in (solid, other)))


def mindlin_ratio(poisson: float) -> float:
    """Tangential over normal stiffness of two like spheres that do not slip (Mindlin 1949)."""
    return 2 * (1 - poisson) / (2 - poisson)


def test_walton_is_the_mean_field_of_hertz_and_mindlin_contacts():
    # (1-φ) C F/(π d²) = P; K = (1-φ) C kₙ/(3π d), G = (1-φ) C (kₙ + 3/2 kₜ)/(5π d).
    pack = Pack(6e-3, 0.40, PLASTIC, 5.3)
    stress = 3_500.0
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
    stress = 3_500.0
    bare = seat(stress, PACK, MATERIALS["steel"], Latex(thickness=0.0))
    modulus = contact_modulus(PLASTIC, MATERIALS["steel"])
    hertz = PACK.seats_per_m2 * hertz_stiffness(stress / PACK.seats_per_m2, 3e-3, modulus)
    assert bare.stiffness_n_m3 == pytest.approx(hertz * 3 * np.pi**2 / 32)


def test_the_span_has_the_stiffness_of_its_closed_form():
    # ⟨w⟩ = p R²/8T ((4 ln(1/s) - 3 + 4s² - s⁴)) for s = b/R.
    span = pinned(200.0, PACK, TENSION, MASS)
    seats = PACK.seats_per_m2
    square = 1 / (np.pi * seats)
    s = np.sqrt(200.0 / seats * 3e-3 / (2 * np.pi * TENSION) / square)
    mean = square / (8 * TENSION) * (-4 * np.log(s) - 3 + 4 * s**2 - s**4)
    assert span.stiffness_n_m3 == pytest.approx(1 / mean, rel=1e-6)


def test_a_strip_bulges_as_its_parabola():
    x = (np.arange(2_000) + 0.5) / 2_000 * 0.01
    sag = x * (0.01 - x) / (2 * TENSION)
    span = strip(0.01, TENSION, MASS)
    assert 1 / span.stiffness_n_m3 == pytest.approx(sag.mean(), rel=1e-6)
    assert span.mass_kg_m2 == pytest.approx(MASS * np.mean(sag**2) / sag.mean() ** 2, rel=1e-6)
