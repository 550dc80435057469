"""Mirror planes of a gripper's transducers, and predicted angles compared with mirror images.

A mirror at angle a maps the place z = x + iy to exp(2ia) z*. On a round roof with a speaker s and a
microphone m there are two ways in which a mirror can leave the sound unchanged: it keeps each
transducer in its place, or it exchanges the two, which by reciprocity gives the same response. The
*misfit* of a mirror is the root mean square distance (mm) between each transducer and the place to
which the mirror should bring it. At a misfit of 0 an object at angle θ and one at 2a - θ give the
same recording.
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


def mirror_planes(gripper: Gripper) -> tuple[MirrorPlane, MirrorPlane]:
    """Return the best plane that keeps each transducer, and the best that exchanges the two.

    The first has exp(2ia) along s² + m² and the misfit √(|s|² + |m|² - |s² + m²|), the second has
    exp(2ia) along s m and the misfit ||s| - |m||.
    """
    s, m = complex(*gripper.speaker_mm), complex(*gripper.microphone_mm)
    squared_misfit = max(0.0, abs(s) ** 2 + abs(m) ** 2 - abs(s * s + m * m))
    return (
        MirrorPlane(_half_phase_deg(s * s + m * m), math.sqrt(squared_misfit)),
        MirrorPlane(_half_phase_deg(s * m), abs(abs(s) - abs(m))),
    )


def mirror_plane(gripper: Gripper) -> MirrorPlane:
    """Return the plane of least misfit."""
    return min(mirror_planes(gripper), key=lambda plane: plane.misfit_mm)


def angle_from_plane(angle_deg: float, plane_deg: float) -> float:
    """Return the angle (degrees, 0 to 90) between a bar and a mirror plane."""
    return abs((angle_deg - plane_deg + 90) % 180 - 90)


def _half_phase_deg(number: complex) -> float:
    return math.degrees(cmath.phase(number)) / 2 % 180


def mirror_image(angle_deg: np.ndarray, plane_deg: float) -> np.ndarray:
    """Return the angles (n,) of the mirror images of bars, 0 to 180 degrees.

    >>> mirror_image(np.array([18.0, 83.0, 170.0]), plane_deg=83.0)
    array([148.,  83., 176.])
    """
    return (2 * plane_deg - angle_deg) % HALF_TURN_DEG


class MirrorErrors(NamedTuple):
    """RMSE (degrees, mean over folds) to the angle, and to the nearer of angle and mirror image.

    `share` is the share of predictions that are nearer to the mirror image than to the angle.
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
    """Return the errors of predictions (n,) of angles `true` (n,) by `fold` (n,).

    Without the `period` of the metric, errors are not reduced to half a turn.

    >>> true, predicted = np.array([20.0, 60.0]), np.array([22.0, 121.0])
    >>> mirror_errors(true, predicted, np.array([0, 1]), plane_deg=90.0)
    MirrorErrors(error=31.5, nearer_error=1.5, share=0.5)
    """
    direct = np.square(wrapped(predicted - true, period))
    mirrored = np.square(wrapped(predicted - mirror_image(true, plane_deg), period))
    share = float(np.mean(mirrored < direct))
    return MirrorErrors(
        _mean_rmse(direct, fold), _mean_rmse(np.minimum(direct, mirrored), fold), share
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
    """Return p of the hypothesis that predictions confuse an angle with its mirror image.

    The mirror image of a wrong prediction is nearer by chance, too. p is therefore the share of
    permutations of the predictions between angles whose ratio of both errors is as small as the
    observed ratio (Phipson & Smyth 2010). All predictions for one angle stay together, because its
    grasps share a placement.
    """
    observed = mirror_errors(true, predicted, fold, plane_deg, period)
    if observed.error == 0:
        return 1.0
    angles, angle_of = np.unique(true, return_inverse=True)
    random = np.random.default_rng(seed)
    as_small = 0
    for _ in range(permutations):
        labels = random.permutation(angles)[angle_of]
        shuffled = mirror_errors(labels, predicted, fold, plane_deg, period)
        as_small += shuffled.nearer_error * observed.error <= observed.nearer_error * shuffled.error
    return (as_small + 1) / (permutations + 1)
