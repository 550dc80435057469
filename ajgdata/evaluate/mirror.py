"""Mirror planes of a gripper's transducers, and predicted angles compared with mirror images.

A mirror plane at angle a maps the position z = x + iy to exp(2ia) z*. On a round roof with a
speaker at s and a microphone at m, there are two types of planes that leave the response unchanged.
The first type maps each transducer to itself. The second type exchanges both transducers; the
response is then equal by reciprocity. The *misfit* of a plane is the root mean square distance (mm)
between the mirror images of the transducers and these positions. If the misfit is 0, an object at
angle θ and one at 2a - θ give the same recording.
"""

from __future__ import annotations

import cmath
import math
from typing import NamedTuple

import numpy as np

from ajgdata.evaluate.metrics import wrapped
from ajgdata.gripper.grippers import Gripper

#: A bar has the same position after half a turn.
HALF_TURN_DEG = 180.0
PERMUTATIONS = 999


class MirrorPlane(NamedTuple):
    """Angle of a mirror plane with the x axis (degrees, 0 to 180), and its misfit (mm)."""

    angle_deg: float
    misfit_mm: float


def mirror_plane(gripper: Gripper) -> MirrorPlane:
    """Return the plane with the smallest misfit."""
    return min(mirror_planes(gripper), key=lambda plane: plane.misfit_mm)


def mirror_planes(gripper: Gripper) -> tuple[MirrorPlane, MirrorPlane]:
    """Return the best plane that maps each transducer to itself, and the best that exchanges both.

    For the first, exp(2ia) has the phase of s² + m², and the misfit is √(|s|² + |m|² - |s² + m²|).
    For the second, exp(2ia) has the phase of s m, and the misfit is ||s| - |m||.
    """
    s = complex(*gripper.speaker_mm)
    m = complex(*gripper.microphone_mm)
    squared_misfit = max(0.0, abs(s) ** 2 + abs(m) ** 2 - abs(s * s + m * m))
    return (
        MirrorPlane(_half_phase_deg(s * s + m * m), math.sqrt(squared_misfit)),
        MirrorPlane(_half_phase_deg(s * m), abs(abs(s) - abs(m))),
    )


def _half_phase_deg(number: complex) -> float:
    """Return half the phase of a number in degrees, 0 to 180."""
    return math.degrees(cmath.phase(number)) / 2 % 180


def angle_from_plane(angle_deg: float, plane_deg: float) -> float:
    """Return the angle (degrees, 0 to 90) between a bar and a mirror plane."""
    return abs((angle_deg - plane_deg + 90) % 180 - 90)


def mirror_image(angle_deg: np.ndarray, plane_deg: float) -> np.ndarray:
    """Return the angles (n,) of the mirror images of bars, 0 to 180 degrees.

    >>> mirror_image(np.array([18.0, 83.0, 170.0]), plane_deg=83.0)
    array([148.,  83., 176.])
    """
    return (2 * plane_deg - angle_deg) % HALF_TURN_DEG


class MirrorErrors(NamedTuple):
    """RMSE (degrees, mean over folds) of predicted angles.

    `error` is computed from the distances to the true angle, and `nearer_error` from those to the
    true angle or its mirror image, whichever is nearer. `share` is the share of predictions that
    are nearer to the mirror image.
    """

    error: float
    nearer_error: float
    share: float


def mirror_errors(
    true: np.ndarray,
    predicted: np.ndarray,
    fold: np.ndarray,
    plane_deg: float,
    period: float | None = None,
) -> MirrorErrors:
    """Return the errors of the angles `predicted` (n,) by `fold` (n,), from the angles `true` (n,).

    With the `period` of the metric, angles that differ by a period are equal.

    >>> true, predicted = np.array([20.0, 60.0]), np.array([22.0, 121.0])
    >>> mirror_errors(true, predicted, np.array([0, 1]), plane_deg=90.0)
    MirrorErrors(error=31.5, nearer_error=1.5, share=0.5)
    """
    direct = np.square(wrapped(predicted - true, period))
    mirrored = np.square(wrapped(predicted - mirror_image(true, plane_deg), period))
    share = float(np.mean(mirrored < direct))
    return MirrorErrors(
        error=_mean_rmse(direct, fold),
        nearer_error=_mean_rmse(np.minimum(direct, mirrored), fold),
        share=share,
    )


def _mean_rmse(squares: np.ndarray, fold: np.ndarray) -> float:
    """Return the mean over folds of the root mean square."""
    return float(np.mean([math.sqrt(squares[fold == k].mean()) for k in np.unique(fold)]))


def mirror_p(
    true: np.ndarray,
    predicted: np.ndarray,
    fold: np.ndarray,
    plane_deg: float,
    period: float | None = None,
    *,
    permutations: int = PERMUTATIONS,
    seed: int = 0,
) -> float:
    """Return the p value of the ratio of `nearer_error` to `error` (see `MirrorErrors`).

    A wrong prediction is also nearer to the mirror image by chance. The null hypothesis is that the
    predictions do not depend on the angle. Each permutation exchanges the true angles, and p is the
    share of permutations whose ratio is not larger than the observed one (Phipson & Smyth 2010).
    All grasps of one angle stay together, because they share a placement.
    """
    observed = mirror_errors(true, predicted, fold, plane_deg, period)
    if observed.error == 0:
        return 1.0
    angles, angle_number = np.unique(true, return_inverse=True)
    random = np.random.default_rng(seed)
    as_small = 0
    for _ in range(permutations):
        shuffled_true = random.permutation(angles)[angle_number]
        shuffled = mirror_errors(shuffled_true, predicted, fold, plane_deg, period)
        if shuffled.nearer_error * observed.error <= observed.nearer_error * shuffled.error:
            as_small += 1
    return (as_small + 1) / (permutations + 1)
