"""Bending modes of a plate against the literature and against a strip, a beam; and on a ring."""

import numpy as np
import pytest

from ajgdata.gripper.bending import Load, Plate, Ring, plate_modes, ring_modes
from ajgdata.gripper.contact import Spring
from ajgdata.gripper.object_materials import MATERIALS

FREE = Spring(0.0, 0.0)
STEEL = MATERIALS["steel"]
SQUARE = Plate(0.1, 0.1, 5e-3, STEEL)
#: Leissa gives most roots of discs for ν = 0.33, of simply supported ones for 0.3 too.
DISC = Plate(0.1, 0.1, 5e-3, STEEL.model_copy(update={"poisson": 0.33}), round=True)


def _roots(plate: Plate, modes, length: float) -> np.ndarray:
    """λ² = ω a² √(ρh/D)."""
    return np.sqrt(modes.square * plate.per_area / plate.rigidity) * length**2


def test_a_free_square_plate_has_leissas_roots():
    # Leissa, NASA SP-160 (1969), table 4.66 after Ritz, ν = 0.3 (in four digits, upper bounds).
    roots = _roots(SQUARE, plate_modes(SQUARE, FREE), 0.1)
    assert roots[:3] == pytest.approx([13.47, 19.60, 24.27], rel=2e-3)
    assert roots[3:] == pytest.approx([34.80, 34.80], rel=2e-3)


def test_a_free_disc_has_leissas_roots():
    # Leissa (1969), table 2.5, ν = 0.33, a the radius: two, none and three nodal diameters.
    roots = _roots(DISC, plate_modes(DISC, FREE), 0.05)
    assert roots == pytest.approx([5.253, 5.253, 9.084, 12.23, 12.23], rel=2e-3)


def test_a_strip_without_lateral_contraction_is_a_beam():
    # Free beam: λ = 4.7300, 7.8532; at ν = 0 the plate's rigidity is the beam's.
    strip = Plate(0.5, 0.01, 1e-3, STEEL.model_copy(update={"poisson": 0.0}))
    roots = _roots(strip, plate_modes(strip, FREE), 0.5)
    assert roots[0] == pytest.approx(4.7300**2, rel=1e-4)


def test_a_foundation_adds_its_own_square_and_loss():
    sheet = Spring(4e9, 0.15)
    free, held = (plate_modes(SQUARE, bed) for bed in (FREE, sheet))
    shift = sheet.stiffness_n_m3 / (7850 * 5e-3)
    assert held.square - free.square == pytest.approx(np.full(5, shift), rel=1e-9)
    assert free.loss == pytest.approx(np.full(5, STEEL.loss))
    assert np.all(np.diff(held.loss[:4]) < 0) and np.all(
        (STEEL.loss < held.loss) & (held.loss < 0.15)
    )


def _hard(plate: Plate) -> float:
    """Stiffness per length (N/m²) beside which the plate is as soft as 1e-5."""
    return 1e5 * plate.rigidity / (plate.length / 2) ** 3


def test_a_disc_on_a_hard_ring_at_its_edge_is_simply_supported():
    # Leissa (1969), section 2.1.2, table 2.2, ν = 0.3: no, one, two nodal diameters; and for the
    # first at ν = 0.33 Leissa & Narita (J. Sound Vib. 70, 1980): 4.977.
    plate = Plate(0.1, 0.1, 5e-3, STEEL, round=True)
    modes = ring_modes(plate, Ring(0.05, _hard(plate), 0.0), count=5)
    # The ring's give takes off what it is softer than a wall: of order 1e-4.
    exact = [4.9351, 13.898, 13.898, 25.613, 25.613]
    assert _roots(plate, modes, 0.05) == pytest.approx(exact, rel=1e-3)
    first = ring_modes(DISC, Ring(0.05, _hard(DISC), 0.0), count=1)
    assert _roots(DISC, first, 0.05) == pytest.approx([4.977], rel=1e-3)


def test_a_stiff_plate_on_a_soft_ring_bounces_and_tilts_as_a_mass_on_springs():
    ring = Ring(0.035, 1e3, 0.15)
    riding = Load(np.array([0.01]), np.array([0.0]), np.array([0.02]))
    for load, extra in ((None, 0.0), (riding, 0.02)):
        modes = ring_modes(SQUARE, ring, load, count=3)
        mass = 0.01 * SQUARE.per_area
        # Bounce k 2πa/m, tilt k πa³/I with I = m L²/12; the riding mass shifts bounce by m(1 + ε)
        # and couples it to one tilt by 1e-2 of its square.
        bounce = ring.stiffness_n_m2 * 2 * np.pi * ring.radius / (mass + extra)
        tilt = ring.stiffness_n_m2 * np.pi * ring.radius**3 / (mass * 0.1**2 / 12)
        rel = 1e-4 if load is None else 2e-2
        assert sorted(modes.square) == pytest.approx(sorted([bounce, tilt, tilt]), rel=rel)
        assert modes.loss == pytest.approx(np.full(3, 0.15), rel=1e-3)
