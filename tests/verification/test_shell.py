"""A thin hollow sphere rings as Lamb (1882) says, and yields to pressure as a vessel does."""

import numpy as np
import pytest

from ajgdata.gripper.bending import DEGREES, shell_modes
from ajgdata.gripper.objects import MATERIALS

RADIUS = 39e-3


@pytest.mark.parametrize("thickness", [1e-9, 3e-3])
def test_both_modes_of_a_degree_are_the_roots_of_junger_and_feit(thickness):
    """Without bending, at 1 nm, the roots are those of Lamb. Ω² = ω²a²ρ(1-ν²)/E."""
    material = MATERIALS["plastic"]
    modes = shell_modes(RADIUS, thickness, material)
    nu = material.poisson
    bend = thickness**2 / (12 * RADIUS**2)
    squares = (
        modes.omega_squared * RADIUS**2 * material.density_kg_m3 * (1 - nu**2) / material.young_pa
    )
    assert squares[modes.degree == 0] == pytest.approx([2 * (1 + nu)])
    for degree in range(2, DEGREES + 1):
        lam = degree * (degree + 1)
        linear = 1 + 3 * nu + lam - bend * (1 - nu - lam**2 - nu * lam)
        free = (lam - 2) * (1 - nu**2)
        free += bend * (lam**3 - 4 * lam**2 + lam * (5 - nu**2) - 2 * (1 - nu**2))
        # The constant differs by terms of the order β⁴, which the thin shell leaves out.
        roots = np.sort(np.roots([1, -linear, free]))
        assert squares[modes.degree == degree] == pytest.approx(
            roots, rel=2 * (lam * bend) ** 2 + 1e-9
        )
    assert (
        np.all(np.diff(modes.omega_squared) >= 0)
        and len(modes.omega_squared) == 2 * (DEGREES - 1) + 1
    )


def test_under_pressure_from_all_sides_it_shrinks_as_a_vessel_does():
    """w = p a² (1-ν)/(2 E h): only the breathing mode is pressed, and it holds all of the mass."""
    material = MATERIALS["aluminium"]
    thickness = 1e-3
    modes = shell_modes(RADIUS, thickness, material)
    nodes, weights = np.polynomial.legendre.leggauss(DEGREES + 2)
    shapes = modes.at(nodes)
    pressed = 2 * np.pi * RADIUS**2 * shapes @ weights
    shrunk = (pressed / modes.omega_squared) @ shapes
    vessel = RADIUS**2 * (1 - material.poisson) / (2 * material.young_pa * thickness)
    assert shrunk == pytest.approx(np.full(len(nodes), vessel), rel=1e-9)
