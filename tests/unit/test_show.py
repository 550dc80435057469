"""Drawings of a scene: the cut through the cavity, and the names in it."""

import numpy as np
import pytest

from ajgdata.gripper import Scene
from ajgdata.report.scenes import section

CUBE = {"object": {"kind": "cube", "edge_mm": 20}, "numerics": {"dx_mm": 6}}
SCENE = Scene.model_validate(CUBE)


def test_the_section_is_the_cavity_of_the_scene():
    cut = section(SCENE)
    np.testing.assert_array_equal(cut.x, -cut.x[::-1])
    on_top = cut.inside & (np.abs(cut.x) < 5)
    # the membrane lies on the cube, an edge above the table; what it lacks is its smoothing's:
    # half of 1.5 mm squared times the balloon's curvature of 2 x 45 mm / (50 mm)^2 is 0.04 mm
    np.testing.assert_allclose(cut.top[on_top] - cut.table, 20, atol=1e-9)
    np.testing.assert_allclose(cut.floor[on_top], cut.top[on_top], atol=0.045)
    # the raster is 0.5 mm
    assert np.ptp(cut.x[cut.inside]) == pytest.approx(20, abs=1)
    # off the axis the balloon is more curved, at r = 30 mm by 0.8^-3
    assert cut.floor.min() >= cut.table - 0.045 * 0.8**-3
    assert section(Scene()).table is None
