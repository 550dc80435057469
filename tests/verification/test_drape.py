"""A membrane under tension: known shapes over edges, holes and posts, and what follows from it."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from ajgdata.gripper import Scene
from ajgdata.gripper.drape import bridged
from ajgdata.gripper.geometry import cavity
from ajgdata.gripper.relief import STEEPEST

STEP = 0.5e-3
#: T/p, as of 43 N/m against 3.6 kPa.
RADIUS = 12e-3
AXIS = np.arange(-60, 61) * STEP
X, Y = np.meshgrid(AXIS, AXIS)
away = np.hypot(X, Y)
MIDDLE = len(AXIS) // 2


def wall(top, beyond):
    """A step of height `top`, upright as far as the raster goes, at `beyond` = 0."""
    return np.clip(top - STEEPEST * np.clip(beyond, 0, None), 0, None)


def test_beside_a_straight_edge_it_is_an_arc_that_is_level_where_it_lands():
    top = 4e-3
    height = bridged(wall(top, X), STEP, RADIUS)
    reach = np.sqrt(RADIUS**2 - (RADIUS - top) ** 2)
    left = np.clip(reach - AXIS, 0, reach)
    arc = RADIUS - np.sqrt(RADIUS**2 - left**2)
    # Second order in the step, less than 1 µm here, and what a fixed number of sweeps leaves: the
    # tolerance is where the arc is a tenth of a sample from where it should be, h/10 times a slope
    # of 0.9.
    assert np.abs(height - arc)[:, AXIS > 0].max() < 0.09 * STEP
    assert np.abs(height - top)[:, AXIS <= 0].max() == 0


def post(reach, at):
    """Height of the membrane at `at` from the axis of an upright post: r sin ψ grows by r dr
    T/p from where it lands, at `reach`."""
    lean = lambda r: (reach**2 - r**2) / (2 * RADIUS * r)  # noqa: E731
    return quad(lambda r: lean(r) / np.sqrt(1 - lean(r) ** 2), at, reach)[0]


def test_round_a_post_it_is_the_axisymmetric_membrane():
    top, edge = 3e-3, 10e-3
    height = bridged(wall(top, away - edge), STEP, RADIUS)

    def exact(edge):
        steepest = np.sqrt(edge**2 + 2 * RADIUS * edge)
        reach = brentq(lambda b: post(b, edge) - top, edge * 1.0001, steepest * 0.9999)
        return np.array([post(reach, r) if r < reach else 0.0 for r in AXIS[MIDDLE:][beside]])

    beside = AXIS[MIDDLE:] > edge + 2 * STEP
    found = height[MIDDLE, MIDDLE:][beside]
    # The post's edge is known to a sample; a larger post lifts the membrane everywhere.
    assert np.all(found <= exact(edge + STEP / 2))
    assert np.all(found >= exact(edge - STEP))


def test_over_a_round_hole_it_is_a_sphere_of_twice_the_radius():
    hole, far = 10e-3, 2 * RADIUS
    height = bridged(np.maximum(-10e-3, -STEEPEST * np.clip(hole - away, 0, None)), STEP, RADIUS)
    within = np.sqrt(far**2 - np.minimum(away, hole) ** 2)

    def cap(edge):
        return np.where(away < edge, np.sqrt(far**2 - edge**2) - within, 0.0)

    inside = away < hole - 2 * STEP
    assert np.all(height[inside] > cap(hole + STEP)[inside])
    assert np.all(height[inside] < cap(hole - STEP)[inside])


CALM = dict.fromkeys(("roughness_mm", "slope_deg", "packing", "force", "temperature_k"), 0)


def _cavity(**keys):
    given = {"object": "cube_20p7", "grasp": {"nuisance": CALM}, **keys}
    return cavity(Scene.model_validate(given))


def test_grains_larger_than_the_arc_hold_the_membrane_off():
    slack = {"membrane": {"stiffness_n_m3": 1e3}}
    fine, coarse = (
        _cavity(gripper=slack, medium={"grain_diameter_mm": d}).table_m for d in (0.7, 12.0)
    )
    # About (1 - π/4) 36 mm² along 80 mm of edge, over some 35 cm²: 0.18 mm.
    assert fine - coarse == pytest.approx(0.18e-3, rel=0.3)
