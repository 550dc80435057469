"""The column ground - object - membrane - grains against bodies with a closed solution."""

from functools import partial

import numpy as np
import pytest

from ajgdata.gripper.column import Body, cone_slope, solve, stack
from ajgdata.gripper.objects import MATERIALS

FOAM = MATERIALS["styrofoam"]
WIDE = 4e-4


def _full(area, z):
    return np.full_like(z, area)


def _block(height, area, material=FOAM):
    return Body(material, height, partial(_full, area), area, area)


def _static(body, **given_):
    """Flexibility of the imprint, m/N: core and skin."""
    modes = solve(stack(body, 0.0, **given_))
    core = float(np.sum(modes.shapes[:, 0] ** 2 / modes.omega_squared))
    return core + body.skin_flexibility / body.imprint_m2


def test_a_slender_block_yields_as_a_rod():
    # The core is never quite without height: a part in a thousand is counted twice at most.
    exact = 0.2 / (FOAM.young_pa * WIDE)
    assert _static(_block(0.2, WIDE)) == pytest.approx(exact, rel=1e-9)
    assert _static(_block(0.002, WIDE)) == pytest.approx(exact / 100, rel=1.01e-3)


def test_a_half_space_yields_as_under_a_uniform_load():
    radius = 5e-3
    height = 0.5
    body = Body(FOAM, height, partial(_full, 1e3), 1e3, np.pi * radius**2)
    exact = 16 * (1 - FOAM.poisson**2) / (3 * np.pi * FOAM.young_pa * np.pi * radius)
    # The ground, a hundred radii away, takes off what lies below: a / (a + s H).
    below = radius / (radius + cone_slope(FOAM.poisson) * height)
    assert _static(body) == pytest.approx(exact * (1 - below), rel=5e-3)


def test_the_core_rings_as_a_rod_with_one_end_held():
    body = _block(0.2, WIDE)
    radius = np.sqrt(WIDE / np.pi)
    # The skin rides on the core: its mass m lowers the quarter-wave resonance of a rod
    # of mass M: cot x = x m/M.
    x = np.linspace(0.5, 1.6, 200_001)
    ratio = radius / (0.2 - radius)
    root = x[np.argmin(np.abs(1 / np.tan(x) - ratio * x))]
    exact = root * np.sqrt(FOAM.young_pa / FOAM.density_kg_m3) / (0.2 - radius)
    # 32 linear elements err by (kh)²/24.
    cap = (root / 32) ** 2 / 24 * 1.05 + 1e-5
    assert np.sqrt(solve(stack(body, 0.0)).omega_squared[0]) == pytest.approx(exact, rel=cap)
