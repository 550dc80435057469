"""Mirror planes, angles relative to them, and the rule that fixes the gripper `unequal-radii`."""

import math

from mirror_symmetry import (
    mirror_plane,
    mirror_planes,
)

from ajgdata.gripper.grippers import GRIPPERS, Gripper

#: The paper's distance of speaker and microphone, and how far a design in tenths may miss it.
APART_MM, ROUNDED_MM = 70.0, 0.05
#: The aim: no mirror brings the transducers nearer to their own places than this.
AIM_MM = 10.0
UNEQUAL = GRIPPERS["unequal-radii"]


def test_the_default_gripper_almost_equals_its_mirror_image():
    """Both misfits are less than the transducers are wide."""
    width = 2 * GRIPPERS["default"].transducer_sigma_mm
    assert max(plane.misfit_mm for plane in mirror_planes(GRIPPERS["default"])) < width


def test_unequal_radii_meets_its_aim():
    kept, exchanged = mirror_planes(UNEQUAL)
    assert min(kept.misfit_mm, exchanged.misfit_mm) >= AIM_MM
    assert abs(math.dist(UNEQUAL.speaker_mm, UNEQUAL.microphone_mm) - APART_MM) <= ROUNDED_MM


def test_unequal_radii_has_the_default_s_plane_and_differs_in_nothing_else():
    """A bar then has the same angle from the plane of both, so their errors can be compared."""
    # for a bar, which equals itself after half a turn, planes at a and a + 90 are one
    apart = (mirror_plane(UNEQUAL).angle_deg - mirror_plane(Gripper()).angle_deg + 45) % 90 - 45
    assert abs(apart) < 0.1
    same = {"roof_radius_mm", "speaker_mm", "microphone_mm"}
    assert UNEQUAL.model_dump(exclude=same) == Gripper().model_dump(exclude=same)
