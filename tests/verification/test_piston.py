"""A piston of any mass, resistance and stiffness at the end of a tube."""

import numpy as np
import pytest
from known_cases.piston import (
    LENGTH_M,
    OMEGA,
    PISTONS,
    transfer_function,
    tube,
)

from ajgdata.studies.domains import AIR


@pytest.mark.parametrize("as_mode", [False, True])
def test_a_piston_of_nothing_holds_no_pressure(as_mode):
    heard, _, _ = tube(8e-3, (0.0, 0.0, 0.0), as_mode)
    beside, _, _ = tube(8e-3, PISTONS["steel"], as_mode)
    # Round-off as a mode; as a wall what its least impedance leaves, 1e-6 of 413 Pa s/m, twice.
    assert np.abs(heard).max() < 1e-8 * np.abs(beside).max()


def test_the_theory_has_its_limits():
    k, z0 = OMEGA / AIR.sound_speed, AIR.density * AIR.sound_speed
    # A matched end: nothing comes back, p = ρc u delayed by the way.
    matched = transfer_function(0.0, (0.0, z0, 0.0))
    assert matched == pytest.approx(z0 * np.exp(-1j * k * LENGTH_M))
    # A closed end: p = -i ρc u / sin kL.
    closed = transfer_function(0.0, (0.0, 0.0, 1e20))
    assert closed == pytest.approx(-1j * z0 / np.sin(k * LENGTH_M), rel=1e-6)
