"""Air trapped between membrane and object: the spring of a slit, in series with what is below."""

import numpy as np
import pytest

from ajgdata.gripper import Scene
from ajgdata.gripper.air_film import AirFilm, film_spring, gap_m
from ajgdata.gripper.column import Skin
from ajgdata.gripper.medium import Air

AIR = Air(22.0)


def test_a_thin_film_is_isothermal_and_a_thick_one_adiabatic():
    thin = film_spring(1e-6, AIR)
    thick = film_spring(0.1, AIR)
    assert thin.stiffness_n_m3 * 1e-6 == pytest.approx(AIR.pressure_pa, rel=1e-3)
    # What is left of the boundary layers, (γ-1)√2 δ/h with δ = 37 µm at 5 kHz: 2e-4.
    assert thick.stiffness_n_m3 * 0.1 == pytest.approx(1.4 * AIR.pressure_pa, rel=5e-4)
    assert thin.loss < 1e-3 and thick.loss < 1e-3
    # Heat moves in step with the sound where the gap is about twice the thermal layer.
    gaps = np.geomspace(1e-6, 1e-2, 60)
    losses = np.array([film_spring(gap, AIR).loss for gap in gaps])
    assert 0.1 < losses.max() < 0.4 / 2
    assert 50e-6 < gaps[losses.argmax()] < 200e-6


def _exact(film, below, omega):
    """Membrane on a spring on a skin: two degrees of freedom."""
    skin = 1j * omega * (below.mass - film.membrane_kg_m2) + below.resistance
    skin = skin + below.stiffness / (1j * omega)
    spring = film.spring.stiffness_n_m3 * (1 + 1j * film.spring.loss) / (1j * omega)
    return 1j * omega * film.membrane_kg_m2 + 1 / (1 / spring + 1 / skin)


@pytest.mark.parametrize("thickness", [5e-6, 200e-6])
@pytest.mark.parametrize(
    "below",
    [
        Skin(100.0, 2e7, 2e13),  # steel under an imprint of 25 mm
        Skin(0.5, 5e3, 3e8),  # Styrofoam
    ],
)
def test_one_degree_of_freedom_stands_for_two(below, thickness):
    film = AirFilm(thickness, film_spring(thickness, AIR), 0.3)
    got = film.over(below)
    for hertz in (200.0, 1_000.0, 3_000.0):
        omega = 2 * np.pi * hertz
        impedance = 1j * omega * got.mass + got.resistance + got.stiffness / (1j * omega)
        assert abs(impedance - _exact(film, below, omega)) < 0.08 * abs(impedance)


def test_the_gap_is_the_given_one_or_the_geometric_mean_of_the_material():
    cube = {"kind": "cube", "edge_mm": 20, "material": "wood"}
    assert gap_m(Scene.model_validate({"object": cube})) == pytest.approx(np.sqrt(10 * 40) * 1e-6)
    given = Scene.model_validate({"object": cube | {"gap_um": 7.0}})
    assert gap_m(given) == pytest.approx(7e-6)
