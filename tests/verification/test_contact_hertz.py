"""Single contacts against Hertz, Love and a thin-film solution."""

import numpy as np
import pytest
from known_cases.hertz import hertz_stiffness
from scipy.integrate import quad

from ajgdata.gripper.contact import (
    layer_approach,
    layer_stiffness,
    plane_modulus,
    spread_compliance,
)


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
    assert layer_approach(film, radius, thickness, young) == pytest.approx(approach, rel=0.05)


def test_a_disc_of_pressure_sinks_by_loves_mean():
    # Mean of 1/(π E* r) over pairs of points in a disc, by the density of their distance r.
    def density_over_distance(r: float) -> float:
        return 4 / np.pi * (np.arccos(r / 2) - r / 2 * np.sqrt(1 - r * r / 4))

    mean_inverse = quad(density_over_distance, 0, 2)[0]
    modulus, radius = 3e9, 2e-4
    assert spread_compliance(modulus, radius) == pytest.approx(
        mean_inverse / (np.pi * modulus * radius), rel=1e-9
    )
