"""Mirror planes, angles relative to them, and the rule that fixes the gripper `unequal-radii`."""

import math

import numpy as np
from mirror_symmetry import (
    mirror_plane,
    mirror_planes,
)

from ajgdata.gripper.grippers import GRIPPERS, Gripper
from ajgdata.gripper.variation import Variation

#: The paper's distance of speaker and microphone, and how far a design in tenths may miss it.
APART_MM, ROUNDED_MM = 70.0, 0.05
#: The aim: no mirror brings the transducers nearer to their own places than this.
AIM_MM = 10.0
UNEQUAL = GRIPPERS["unequal-radii"]


def test_the_default_gripper_almost_equals_its_mirror_image():
    """Both misfits are less than the transducers are wide."""
    width = 2 * GRIPPERS["default"].transducer_sigma_mm
    assert max(plane.misfit_mm for plane in mirror_planes(GRIPPERS["default"])) < width


def places(roof_mm: float) -> np.ndarray:
    """Return radii (n, 2) of speaker and microphone inside a roof that are APART_MM apart, and meet
    the aim: on a raster of 0.05 mm, with room for their width and for how far they may be off."""
    moved = Variation().gripper.transducers_mm * math.sqrt(2)
    reach = roof_mm - UNEQUAL.transducer_sigma_mm - moved
    radii = np.arange(20, reach + 1e-9, 0.05)
    s, m = (one.ravel() for one in np.meshgrid(radii, radii))
    cosine = (s**2 + m**2 - APART_MM**2) / (2 * s * m)
    possible = abs(cosine) <= 1
    s, m, cosine = s[possible], m[possible], cosine[possible]
    size = s**2 + m**2
    # |s² + m²|² = (|s|² + |m|²)² - 4 |s|² |m|² sin² of the angle between them
    both = np.sqrt(size**2 - 4 * s**2 * m**2 * (1 - cosine**2))
    kept, exchanged = np.sqrt(np.maximum(0, size - both)), abs(s - m)
    return np.column_stack([s, m])[np.minimum(kept, exchanged) >= AIM_MM]


def test_unequal_radii_meets_its_aim_on_the_smallest_roof_that_can():
    kept, exchanged = mirror_planes(UNEQUAL)
    assert min(kept.misfit_mm, exchanged.misfit_mm) >= AIM_MM
    assert abs(math.dist(UNEQUAL.speaker_mm, UNEQUAL.microphone_mm) - APART_MM) <= ROUNDED_MM
    # in whole millimetres
    assert len(places(UNEQUAL.roof_radius_mm)) and not len(places(UNEQUAL.roof_radius_mm - 1))


def test_unequal_radii_has_the_default_s_plane_and_differs_in_nothing_else():
    """A bar then has the same angle from the plane of both, so their errors can be compared."""
    # for a bar, which equals itself after half a turn, planes at a and a + 90 are one
    apart = (mirror_plane(UNEQUAL).angle_deg - mirror_plane(Gripper()).angle_deg + 45) % 90 - 45
    assert abs(apart) < 0.1
    same = {"roof_radius_mm", "speaker_mm", "microphone_mm"}
    assert UNEQUAL.model_dump(exclude=same) == Gripper().model_dump(exclude=same)
