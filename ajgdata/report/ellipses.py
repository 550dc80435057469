"""Points of a plane -> the ellipse that stands for them, whatever the points are."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Real = NDArray[np.floating]
#: Axes shorter than this share of what a coordinate can resolve are round-off of a line or a point.
RESOLUTION = 8 * float(np.finfo(float).eps)
_LARGEST, _SMALLEST = float(np.finfo(float).max), float(np.finfo(float).tiny)


class Ellipse(NamedTuple):
    """Centre, half axes (long, short; >= 0) and the angle of the long one, -90° < angle <= 90°.

    A line has a short axis of 0, a point two axes of 0.
    """

    centre: tuple[float, float]
    half_axes: tuple[float, float]
    angle_deg: float

    def inside(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Which of the points (n, 2) lie within it. Of a line or a point: on it, to round-off."""
        away = np.asarray(points, float) - self.centre
        turn = math.radians(self.angle_deg)
        along = away @ np.array([math.cos(turn), math.sin(turn)])
        across = away @ np.array([-math.sin(turn), math.cos(turn)])
        slack = RESOLUTION * max(*map(abs, self.centre), self.half_axes[0])
        long, short = (max(axis, slack, _SMALLEST) for axis in self.half_axes)
        return np.hypot(along / long, across / short) <= 1


def covariance_ellipse(centre: ArrayLike, covariance: ArrayLike, sigmas: float = 2.0) -> Ellipse:
    """Return the curve at a Mahalanobis distance of `sigmas` from the mean of a Gaussian.

    `centre` (2,), `covariance` (2, 2): symmetric, perhaps singular. Half axes are `sigmas` times
    the roots of its eigenvalues (negative ones are round-off and count as 0). Raises ValueError
    for what is not finite, and for shapes other than these.
    """
    middle, matrix = np.asarray(centre, float), np.asarray(covariance, float)
    if middle.shape != (2,) or matrix.shape != (2, 2):
        raise ValueError(f"need shapes (2,) and (2, 2), got {middle.shape} and {matrix.shape}")
    if not (np.isfinite(middle).all() and np.isfinite(matrix).all()):
        raise ValueError("centre and covariance must be finite")
    scale = float(np.abs(matrix).max()) or 1.0  # eigh squares: a covariance of 1e200 overflows
    values, vectors = np.linalg.eigh(matrix / scale)
    axes = sigmas * np.sqrt(np.maximum(values, 0)) * math.sqrt(scale)
    return _ellipse(middle, axes[1], axes[0], vectors[:, 1])


def points_ellipse(points: ArrayLike, sigmas: float = 2.0) -> Ellipse:
    """The ellipse of the mean and covariance (n - 1) of points (n, 2), at any scale.

    One point and identical points give a point, two points and collinear ones a line. From the
    singular values of the points themselves: squaring them would lose a thin ellipse to round-off.
    Raises ValueError for no points, and for points that are not finite.
    """
    given = np.asarray(points, float)
    if given.ndim != 2 or given.shape[1] != 2 or not len(given):
        raise ValueError(f"need points of shape (n, 2) with n > 0, got {given.shape}")
    if not np.isfinite(given).all():
        raise ValueError("points must be finite")
    largest = float(np.abs(given).max()) or 1.0
    unit = given / largest
    middle = unit.mean(axis=0)
    away = np.vstack([unit - middle, [[0.0, 0.0]]])  # two rows at least: two singular values
    _, singular, directions = np.linalg.svd(away, full_matrices=False)
    deviation = singular / math.sqrt(max(len(given) - 1, 1))
    deviation[deviation < RESOLUTION] = 0
    # Python's floats overflow to infinity in silence; the longest axis is the largest number.
    long, short = (min(float(sigmas * a) * largest, _LARGEST) for a in deviation)
    return _ellipse(middle * largest, long, short, directions[0])


def _ellipse(centre: Real, long: float, short: float, direction: Real) -> Ellipse:
    """Round-off kept out of the angle: a point has none, and directions have no sign."""
    angle = math.degrees(math.atan2(direction[1], direction[0])) if long > 0 else 0.0
    half_turns = math.ceil(angle / 180 - 0.5)  # into (-90°, 90°]
    return Ellipse(
        (float(centre[0]), float(centre[1])),
        (float(long), float(short)),
        angle - 180 * half_turns,
    )
