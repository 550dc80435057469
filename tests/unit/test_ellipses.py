"""Known covariances give known ellipses; whatever the points are, something sensible is drawn."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from ajgdata.report.ellipses import Ellipse, covariance_ellipse, points_ellipse

EPS = np.finfo(float).eps


def turned(angle_deg):
    a = math.radians(angle_deg)
    return np.array([[math.cos(a), -math.sin(a)], [math.sin(a), math.cos(a)]])


@pytest.mark.parametrize("angle", [0, 30, 45, 90, -60, -89])
@pytest.mark.parametrize("scale", [1, 1e-150, 1e150])
def test_a_known_covariance(angle, scale):
    r = turned(angle)
    found = covariance_ellipse([1, -2], scale * (r @ np.diag([9, 4]) @ r.T), sigmas=2)
    assert found.centre == (1, -2)
    # the root of an eigenvalue that is right to a few eps is right to a few eps
    np.testing.assert_allclose(found.half_axes, np.sqrt(scale) * np.array([6, 4]), rtol=8 * EPS)
    assert found.angle_deg == pytest.approx(angle, abs=1e-12)


def test_a_round_covariance_is_a_circle():
    found = covariance_ellipse([0, 0], np.eye(2) * 4, sigmas=1)
    assert found.half_axes == (2, 2)


@pytest.mark.parametrize(
    ("matrix", "half_axes"),
    [
        (np.zeros((2, 2)), (0, 0)),
        (np.array([[1, 2], [2, 4]]), (2 * math.sqrt(5), 0)),  # a line of slope 2
        (np.array([[0, 0], [0, 9]]), (6, 0)),
    ],
)
def test_a_singular_covariance_is_a_line_or_a_point(matrix, half_axes):
    found = covariance_ellipse([0, 0], matrix)
    # an eigenvalue of 0 is found to eps of the largest, its root to the root of that
    np.testing.assert_allclose(found.half_axes, half_axes, atol=4 * half_axes[0] * math.sqrt(EPS))
    if half_axes[0]:
        assert np.tan(np.radians(found.angle_deg)) == pytest.approx(
            2 if matrix[0, 1] else np.inf, rel=1e-12
        ) or found.angle_deg == pytest.approx(90)


def test_points_on_an_ellipse():
    """Four points at the ends of the axes: variance 2 a² / 3 along each."""
    r = turned(25)
    points = np.array([[3, 0], [-3, 0], [0, 1], [0, -1]]) @ r.T + [10, 20]
    found = points_ellipse(points, sigmas=2)
    np.testing.assert_allclose(found.centre, [10, 20], rtol=4 * EPS)
    expected = 2 * np.sqrt(np.array([18, 2]) / 3)
    np.testing.assert_allclose(found.half_axes, expected, rtol=30 * EPS * 20)
    assert found.angle_deg == pytest.approx(25, abs=1e-11)


def test_it_agrees_with_the_covariance():
    points = np.random.default_rng(0).multivariate_normal([1, 2], [[3, 1], [1, 2]], 50)
    by_matrix = covariance_ellipse(points.mean(axis=0), np.cov(points.T))
    by_points = points_ellipse(points)
    np.testing.assert_allclose(np.hstack(by_points), np.hstack(by_matrix), rtol=1e-12)


def test_two_sigma_hold_86_percent_of_a_gaussian():
    points = np.random.default_rng(1).standard_normal((20_000, 2)) @ [[2, 0], [1, 0.5]]
    share = points_ellipse(points).inside(points).mean()
    expected = 1 - math.exp(-2)
    # 4 standard deviations of a binomial share
    assert abs(share - expected) < 4 * math.sqrt(expected * (1 - expected) / len(points))


@pytest.mark.parametrize("place", [(0, 0), (3, -4), (1e300, 1e300), (1e-300, 0), (1e8, 1e8 + 1)])
@pytest.mark.parametrize("count", [1, 2, 7])
def test_one_point_and_identical_points_are_a_point(place, count):
    found = points_ellipse([place] * count)
    np.testing.assert_allclose(found.centre, place, rtol=2 * EPS)
    assert (found.half_axes, found.angle_deg) == ((0, 0), 0)
    assert found.inside([place]).all()
    assert not found.inside([np.add(place, np.maximum(np.abs(place), 1))]).any()


def test_two_points_are_the_line_through_them():
    found = points_ellipse([[0, 0], [2, 2]], sigmas=2)
    assert found.centre == (1, 1)
    assert found.half_axes[1] == 0 and found.angle_deg == pytest.approx(45)
    assert found.half_axes[0] == pytest.approx(2 * 2, rel=4 * EPS)  # variance 2² / 2 along it
    assert found.inside([[0, 0], [1, 1], [2, 2]]).all()
    assert not found.inside([[1, 1.1], [9, 9]]).any()


@pytest.mark.parametrize("scale", [1e-300, 1e-20, 1, 1e20, 1e300])
def test_collinear_points_are_a_line_at_any_scale(scale):
    points = scale * np.outer(np.linspace(-1, 3, 9), [0.6, -0.8])
    found = points_ellipse(points)
    assert found.half_axes[1] == 0
    assert found.half_axes[0] == pytest.approx(scale * 2 * np.std(np.linspace(-1, 3, 9), ddof=1))
    assert found.angle_deg == pytest.approx(math.degrees(math.atan2(-0.8, 0.6)), abs=1e-9)


def test_a_thin_ellipse_is_not_lost():
    """1e-9 of its length: its square is below the round-off of the long axis's square."""
    along = np.linspace(-1, 1, 11)
    points = np.column_stack([along, 1e-9 * np.cos(np.pi * np.arange(11))])
    across = points_ellipse(points).half_axes[1]
    assert across == pytest.approx(2e-9 * np.std(np.cos(np.pi * np.arange(11)), ddof=1), rel=1e-5)


finite = st.floats(allow_nan=False, allow_infinity=False)
clouds = st.integers(1, 6).flatmap(lambda n: arrays(float, (n, 2), elements=finite))


@settings(max_examples=150, derandomize=True, deadline=None)
@given(clouds)
def test_no_finite_points_raise_or_give_nonsense(points):
    found = points_ellipse(points)
    assert np.isfinite(np.hstack(found)).all()
    assert found.half_axes[0] >= found.half_axes[1] >= 0
    assert -90 < found.angle_deg <= 90
    assert len(found.inside(points / 2)) == len(points)


moderate = st.integers(-100, 100).map(float)


@settings(max_examples=60, derandomize=True, deadline=None)
@given(arrays(float, (5, 2), elements=moderate), st.integers(-40, 40), st.floats(-180, 180))
def test_scaling_and_turning_the_points_does_so_to_the_ellipse(points, power, angle):
    first = points_ellipse(points)
    scaled = points_ellipse(points * 2.0**power)
    assert scaled == Ellipse(
        tuple(np.multiply(first.centre, 2.0**power)),
        tuple(np.multiply(first.half_axes, 2.0**power)),
        first.angle_deg,
    )
    other = points_ellipse(points @ turned(angle).T)
    largest = np.abs(points).max()
    # the turned coordinates are rounded to eps of the largest; axes below RESOLUTION of it are 0
    np.testing.assert_allclose(other.half_axes, first.half_axes, atol=2 * 20 * EPS * largest)


@pytest.mark.parametrize("points", [np.empty((0, 2)), np.zeros((3, 3)), np.zeros(4)])
def test_other_shapes_are_refused(points):
    with pytest.raises(ValueError, match=r"need points of shape \(n, 2\)"):
        points_ellipse(points)


def test_what_is_not_finite_is_refused():
    with pytest.raises(ValueError, match="finite"):
        points_ellipse([[0, np.nan]])
    with pytest.raises(ValueError, match="finite"):
        covariance_ellipse([0, 0], [[np.inf, 0], [0, 1]])
    with pytest.raises(ValueError, match="need shapes"):
        covariance_ellipse([0, 0, 0], np.eye(3))
