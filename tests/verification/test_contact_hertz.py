"""Single contacts against Hertz, Mindlin, Love and a thin-film solution."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from ajgdata.gripper.contact import (
    contact_modulus,
    hertz_approach,
    hertz_stiffness,
    layer_approach,
    layer_force,
    layer_stiffness,
    microslip_loss,
    mindlin_ratio,
    plane_modulus,
    spread_compliance,
)
from ajgdata.gripper.object_materials import MATERIALS

FORCES = st.floats(1e-4, 1e2)
RADII = st.floats(1e-4, 1e-1)


def test_hertz_has_its_force_and_its_third_root():
    # F = 4/3 E* √R δ^(3/2): 1 µm of approach of 1 mm at 1 GPa.
    assert hertz_approach(4 / 3 * np.sqrt(1e-3), 1e-3, 1e9) == pytest.approx(1e-6, rel=1e-12)
    assert hertz_stiffness(8.0, 0.03, 1e9) == pytest.approx(2 * hertz_stiffness(1.0, 0.03, 1e9))
    assert hertz_stiffness(1.0, 0.03, 8e9) == pytest.approx(4 * hertz_stiffness(1.0, 0.03, 1e9))


@given(FORCES, RADII, st.floats(1e6, 1e12))
@settings(max_examples=30, derandomize=True, deadline=None)
def test_stiffness_is_the_slope_of_the_force(force, radius, modulus):
    step = 1e-4 * force
    rise = hertz_approach(force + step, radius, modulus) - hertz_approach(
        force - step, radius, modulus
    )
    # A central difference errs by (step/F)²/3 of the value or less, 1e-8, and by rounding.
    slope = hertz_stiffness(force, radius, modulus)
    assert 2 * step / rise == pytest.approx(slope, rel=1e-7)
    step = 1e-4 * layer_approach(force, radius, 1e-3, modulus)
    middle = layer_approach(force, radius, 1e-3, modulus)
    ends = layer_force(middle + np.array([-step, step]), radius, 1e-3, modulus)
    assert np.diff(ends)[0] / (2 * step) == pytest.approx(
        layer_stiffness(force, radius, 1e-3, modulus), rel=1e-7
    )
    assert layer_force(middle, radius, 1e-3, modulus) == pytest.approx(force, rel=1e-11)


def test_contact_modulus_of_equals_and_with_something_rigid():
    steel, foam = MATERIALS["steel"], MATERIALS["foam"]
    assert contact_modulus(steel, steel) == pytest.approx(200e9 / (2 * (1 - 0.3**2)))
    soft = plane_modulus(foam.young_pa, foam.poisson)
    assert contact_modulus(steel, foam) == pytest.approx(soft, rel=2 * soft / 200e9)
    assert contact_modulus(steel, foam) < soft


def test_a_thick_layer_is_a_half_space_and_a_thin_one_a_squeezed_film():
    force, radius, young = 0.1, 3e-3, 1.5e6
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
    assert layer_force(approach, radius, thickness, young) == pytest.approx(film, rel=0.15)


def test_a_disc_of_pressure_sinks_by_loves_mean():
    # Mean of 1/(π E* r) over pairs of points in a disc, by the density of their distance r.
    def density_over_distance(r: float) -> float:
        return 4 / np.pi * (np.arccos(r / 2) - r / 2 * np.sqrt(1 - r * r / 4))

    mean_inverse = quad(density_over_distance, 0, 2)[0]
    modulus, radius = 3e9, 2e-4
    assert spread_compliance(modulus, radius) == pytest.approx(
        mean_inverse / (np.pi * modulus * radius), rel=1e-9
    )


def test_no_slip_is_softer_sideways_and_microslip_is_the_loop_of_its_backbone():
    assert mindlin_ratio(0.0) == 1.0 and mindlin_ratio(0.5) == pytest.approx(2 / 3)
    # δ ∝ 1 - (1 - t)^(2/3), t = T/μN; Masing: the loop encloses 4 (Tδ - 2 ∫T dδ), and the elastic
    # energy is that of the initial stiffness. The formula is its first term: error of order t.
    for t in (1e-2, 3e-3):
        work = quad(lambda u: 1 - (1 - u) ** (2 / 3), 0, t, epsabs=0, epsrel=1e-13)[0]
        loop = 4 * (2 * (t * (1 - (1 - t) ** (2 / 3)) - work) - t * (1 - (1 - t) ** (2 / 3)))
        stored = 0.5 * (2 / 3) * t**2
        assert loop / (2 * np.pi * stored) == pytest.approx(microslip_loss(t, 1.0, 1.0), rel=t)
