"""Bending modes of a plate against the literature, free and on a ring."""

import numpy as np
import pytest

from ajgdata.gripper.bending import Plate, Ring, ring_modes
from ajgdata.gripper.objects import MATERIALS

FREE = Ring(0.03, 1.0, 0.0)  # N/m², far softer than the plates
STEEL = MATERIALS["steel"]
SQUARE = Plate(0.1, 0.1, 5e-3, STEEL)
#: Leissa gives most roots of discs for ν = 0.33, of simply supported ones for 0.3 too.
DISC = Plate(0.1, 0.1, 5e-3, STEEL.model_copy(update={"poisson": 0.33}), round=True)


def _roots(plate: Plate, modes, length: float) -> np.ndarray:
    """λ² = ω a² √(ρh/D)."""
    return (
        np.sqrt(np.maximum(modes.omega_squared, 0) * plate.mass_per_area / plate.rigidity)
        * length**2
    )


def test_a_free_square_plate_has_leissas_roots():
    # Leissa, NASA SP-160 (1969), table 4.66 after Ritz, ν = 0.3 (in four digits, upper bounds).
    roots = _roots(SQUARE, ring_modes(SQUARE, FREE), 0.1)[3:]  # after bounce and two tilts
    assert roots[:3] == pytest.approx([13.47, 19.60, 24.27], rel=2e-3)
    assert roots[3:] == pytest.approx([34.80, 34.80], rel=2e-3)


def test_a_free_disc_has_leissas_roots():
    # Leissa (1969), table 2.5, ν = 0.33, a the radius: two, none and three nodal diameters.
    roots = _roots(DISC, ring_modes(DISC, FREE), 0.05)[3:]
    assert roots == pytest.approx([5.253, 5.253, 9.084, 12.23, 12.23], rel=2e-3)


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
