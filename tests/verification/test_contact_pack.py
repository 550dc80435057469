"""Moduli of a sphere pack, and the seat of its lowest grains, against single contacts."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from known_cases.hertz import hertz_stiffness

from ajgdata.gripper.contact import (
    Latex,
    Pack,
    plane_modulus,
    seat,
)
from ajgdata.gripper.object_materials import MATERIALS, Material

PLASTIC = MATERIALS["plastic"]


def _solid(young: float, poisson: float = 0.3) -> Material:
    return Material(density_kg_m3=1000.0, young_pa=young, poisson=poisson, loss=0.01)


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


def test_sound_in_the_frame_goes_with_the_sixth_root_of_the_stress():
    pack = Pack(6e-3, 0.40, PLASTIC)
    loose, tight = pack.frame(1e3), pack.frame(64e3)
    speeds = [np.sqrt(f.modulus_pa / f.density) for f in (loose, tight)]
    assert speeds[1] / speeds[0] == pytest.approx(2.0)
    assert loose.density == pytest.approx(720.0) and loose.loss == PLASTIC.loss


def test_glass_beads_are_as_fast_as_in_the_literature():
    # Measured P waves at 100 kPa are about 400-500 m/s in beads of E = 70 GPa with 5-6 contacts;
    # effective-medium theory lies above, by up to a half (Makse et al., PRE 70, 2004, 061302).
    glass = Material(density_kg_m3=2500.0, young_pa=70e9, poisson=0.2, loss=0.0)
    frame = Pack(1e-3, 0.38, glass, 5.5).frame(100e3)
    assert 400 < np.sqrt(frame.modulus_pa / frame.density) < 750


def test_the_membrane_hides_the_object_from_the_grains():
    pack, stress = Pack(6e-3, 0.40, PLASTIC), 3_500.0
    steel, plastic = (seat(stress, pack, MATERIALS[m]) for m in ("steel", "plastic"))
    assert plastic.stiffness_n_m3 < steel.stiffness_n_m3 < seat(stress, pack, None).stiffness_n_m3
    # Bare contacts differ by E*^(2/3) = a third; through the latex by its share of the give.
    moduli = [contact_modulus(PLASTIC, MATERIALS[m]) for m in ("steel", "plastic")]
    bare = np.divide(*hertz_stiffness(1.0, 1.0, np.array(moduli)))
    assert bare > 1.4
    assert 1.0 < steel.stiffness_n_m3 / plastic.stiffness_n_m3 < 1 + (bare - 1) / 20
    stiff = seat(stress, pack, PLASTIC, Latex(young=1.5e8))
    assert stiff.stiffness_n_m3 > 5 * plastic.stiffness_n_m3


def test_without_latex_the_seat_is_hertz():
    # A uniform patch of Hertz's radius gives way by 32/(3π²) as much as Hertz's own pressure.
    pack, stress = Pack(6e-3, 0.40, PLASTIC), 3_500.0
    bare = seat(stress, pack, MATERIALS["steel"], Latex(thickness=0.0))
    modulus = contact_modulus(PLASTIC, MATERIALS["steel"])
    hertz = pack.seats_per_m2 * hertz_stiffness(stress / pack.seats_per_m2, 3e-3, modulus)
    assert bare.stiffness_n_m3 == pytest.approx(hertz * 3 * np.pi**2 / 32)


@given(
    st.floats(0, 1e7),
    st.floats(1e-4, 1e-2),
    st.floats(0.25, 0.85),
    st.floats(1e5, 1e12),
    st.floats(1e5, 1e12),
    st.floats(1e-5, 3e-3),
)
@settings(max_examples=40, derandomize=True, deadline=None)
def test_any_grasp_has_a_finite_positive_frame_and_seat(
    stress, diameter, porosity, young, object_young, thickness
):
    pack, latex = Pack(diameter, porosity, _solid(young)), Latex(thickness)
    frame = pack.frame(stress)
    assert 0 < frame.modulus_pa < np.inf and 0 < frame.density < np.inf
    soft, hard = (seat(stress, pack, _solid(e), latex) for e in (object_young, 10 * object_young))
    assert 0 < soft.stiffness_n_m3 < hard.stiffness_n_m3 < np.inf
    assert 0.01 <= soft.loss <= latex.loss
    tighter = pack.frame(stress + 100.0)
    assert tighter.modulus_pa > frame.modulus_pa
