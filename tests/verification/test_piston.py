"""A piston of any mass, resistance and stiffness at the end of a tube."""

import numpy as np
import pytest
from known_cases.piston import (
    PISTONS,
    tube,
)


@pytest.mark.parametrize("as_mode", [False, True])
def test_a_piston_of_nothing_holds_no_pressure(as_mode):
    heard, _, _ = tube(8e-3, (0.0, 0.0, 0.0), as_mode)
    beside, _, _ = tube(8e-3, PISTONS["steel"], as_mode)
    # Round-off as a mode; as a wall what its least impedance leaves, 1e-6 of 413 Pa s/m, twice.
    assert np.abs(heard).max() < 1e-8 * np.abs(beside).max()
