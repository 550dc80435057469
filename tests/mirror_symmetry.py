"""Mirror planes of a gripper's transducers, and angles of an object relative to a mirror plane.

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

from ajgdata.gripper.grippers import Gripper


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
    kept = max(0.0, abs(s) ** 2 + abs(m) ** 2 - abs(s * s + m * m))
    return (
        MirrorPlane(_half_phase_deg(s * s + m * m), math.sqrt(kept)),
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
