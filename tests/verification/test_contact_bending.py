"""Bending modes of a plate against the literature and against a strip, a beam."""

import numpy as np
import pytest

from ajgdata.gripper.bending import plate_modes
from ajgdata.gripper.contact import Spring, plane_modulus
from ajgdata.gripper.object_materials import MATERIALS, Material

FREE = Spring(0.0, 0.0)
STEEL = MATERIALS["steel"]


def _roots(edge: float, thickness: float, length: float, material: Material) -> np.ndarray:
    """λ² = ω a² √(ρh/D)."""
    modes = plate_modes(length, edge, thickness, material, FREE)
    rigidity = plane_modulus(material.young_pa, material.poisson) * thickness**3 / 12
    return np.sqrt(modes.square * material.density_kg_m3 * thickness / rigidity) * length**2


def test_a_free_square_plate_has_leissas_roots():
    # Leissa, NASA SP-160 (1969), table 4.66 after Ritz, ν = 0.3 (in four digits, upper bounds).
    roots = _roots(0.1, 5e-3, 0.1, STEEL)
    assert roots[:3] == pytest.approx([13.47, 19.60, 24.27], rel=2e-3)
    assert roots[3:] == pytest.approx([34.80, 34.80], rel=2e-3)


def test_a_strip_without_lateral_contraction_is_a_beam():
    # Free beam: λ = 4.7300, 7.8532; at ν = 0 the plate's rigidity is the beam's.
    strip = STEEL.model_copy(update={"poisson": 0.0})
    roots = _roots(0.01, 1e-3, 0.5, strip)
    assert roots[0] == pytest.approx(4.7300**2, rel=1e-4)


def test_shapes_are_orthonormal_and_carry_no_momentum():
    modes = plate_modes(0.12, 0.08, 4e-3, STEEL, FREE)
    x, gauss = np.polynomial.legendre.leggauss(30)
    u, v = (a.ravel() for a in np.meshgrid(0.06 * x, 0.04 * x, indexing="ij"))
    mass = np.outer(gauss, gauss).ravel() * 0.06 * 0.04 * 7850 * 4e-3
    shape = modes.at(u, v)
    assert (shape * mass) @ shape.T == pytest.approx(np.eye(5), abs=1e-9)
    scale = np.sqrt(mass.sum())
    for still in (np.ones_like(u), u / 0.06, v / 0.04):
        assert shape @ (mass * still) / scale == pytest.approx(np.zeros(5), abs=1e-9)


def test_a_foundation_adds_its_own_square_and_loss():
    sheet = Spring(4e9, 0.15)
    free, held = (plate_modes(0.1, 0.1, 5e-3, STEEL, bed) for bed in (FREE, sheet))
    shift = sheet.stiffness_n_m3 / (7850 * 5e-3)
    assert held.square - free.square == pytest.approx(np.full(5, shift), rel=1e-9)
    assert free.loss == pytest.approx(np.full(5, STEEL.loss))
    assert np.all(np.diff(held.loss[:4]) < 0) and np.all(
        (STEEL.loss < held.loss) & (held.loss < 0.15)
    )
