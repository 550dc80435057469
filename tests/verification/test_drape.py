"""A membrane under tension: known shapes over edges, holes and posts, and what follows from it."""

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

from ajgdata.gripper.relief import STEEPEST, bridged

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


def test_mirrored_and_turned_obstacles_have_mirrored_and_turned_membranes():
    """Also at the border, which the obstacles lean over in both directions."""
    ground = wall(4e-3, np.hypot(X - 25e-3, Y - 10e-3) - 8e-3)
    ground = np.maximum(ground, wall(2e-3, np.hypot(X - 29e-3, Y + 20e-3) - 3e-3))
    height = bridged(ground, STEP, RADIUS)
    # What is left is the order of sums: rounding.
    assert np.abs(bridged(ground[:, ::-1], STEP, RADIUS)[:, ::-1] - height).max() < 1e-12
    assert np.abs(bridged(ground[::-1], STEP, RADIUS)[::-1] - height).max() < 1e-12
    assert np.abs(bridged(ground.T, STEP, RADIUS).T - height).max() < 1e-12
    assert np.ptp(height[:, -1]) > 3e-3


def post(reach, at):
    """Height of the membrane at `at` from the axis of an upright post: r sin ψ grows by r dr
    T/p from where it lands, at `reach`."""
    lean = lambda r: (reach**2 - r**2) / (2 * RADIUS * r)  # noqa: E731
    return quad(lambda r: lean(r) / np.sqrt(1 - lean(r) ** 2), at, reach)[0]


def test_round_a_post_it_is_the_axisymmetric_membrane():
    top = 3e-3
    edge = 10e-3
    height = bridged(wall(top, away - edge), STEP, RADIUS)

    def exact(edge):
        steepest = np.sqrt(edge**2 + 2 * RADIUS * edge)
        reach = brentq(lambda b: post(b, edge) - top, edge * 1.0001, steepest * 0.9999)
        return np.array([post(reach, r) if r < reach else 0.0 for r in AXIS[MIDDLE:][beyond]])

    beyond = AXIS[MIDDLE:] > edge + 2 * STEP
    heights = height[MIDDLE, MIDDLE:][beyond]
    # The post's edge is known to a sample; a larger post lifts the membrane everywhere.
    assert np.all(heights <= exact(edge + STEP / 2))
    assert np.all(heights >= exact(edge - STEP))
