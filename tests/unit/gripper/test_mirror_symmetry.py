"""Mirror planes, angles relative to them, and the rule that fixes the gripper `unequal-radii`."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from mirror_symmetry import (
    angle_from_plane,
    mirror_image,
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


def reflected(place: complex, plane_deg: float) -> complex:
    return np.exp(2j * np.deg2rad(plane_deg)) * place.conjugate()


@given(st.floats(0, 180), st.floats(10, 35), st.floats(10, 35), st.floats(20, 160))
@settings(max_examples=25, derandomize=True, deadline=None)
def test_mirrored_transducers_have_a_plane_without_misfit(axis, near, far, opening):
    """Either both are on the plane, or one is the mirror image of the other."""
    on = np.exp(1j * np.deg2rad(axis))
    half = np.exp(1j * np.deg2rad(opening / 2))
    for speaker, microphone in ((near * on, -far * on), (near * on * half, near * on / half)):
        assume(abs(speaker - microphone) > 5)  # they may not overlap
        gripper = Gripper(
            speaker_mm=(speaker.real, speaker.imag),
            microphone_mm=(microphone.real, microphone.imag),
        )
        plane = mirror_plane(gripper)
        # the misfit is the root of a difference of squares of 35 mm: √eps of that
        assert plane.misfit_mm < 1e-5
        images = {reflected(one, plane.angle_deg) for one in (speaker, microphone)}
        for place in (speaker, microphone):
            assert min(abs(place - image) for image in images) < 1e-5


@pytest.mark.parametrize("name", sorted(GRIPPERS))
def test_both_planes_are_the_best_of_all_angles(name):
    s, m = (complex(*place) for place in (GRIPPERS[name].speaker_mm, GRIPPERS[name].microphone_mm))

    def misfits(angle: float) -> np.ndarray:
        first, second = reflected(s, angle), reflected(m, angle)
        kept = abs(first - s) ** 2 + abs(second - m) ** 2
        exchanged = abs(first - m) ** 2 + abs(second - s) ** 2
        return np.sqrt(np.array([kept, exchanged]) / 2)

    planes = mirror_planes(GRIPPERS[name])
    least = np.min([misfits(angle) for angle in np.linspace(0, 180, 721)], axis=0)
    for which, plane in enumerate(planes):
        # for a misfit of 0 the root of a rounding error of (40 mm)², see above
        assert misfits(plane.angle_deg)[which] == pytest.approx(plane.misfit_mm, abs=1e-5)
        assert plane.misfit_mm <= least[which] + 1e-5
    assert mirror_plane(GRIPPERS[name]).misfit_mm == min(plane.misfit_mm for plane in planes)


def test_a_bar_and_its_mirror_image_have_one_angle_from_the_plane():
    angles = np.arange(0, 180, 4.5)
    for plane in (0.0, 83.4, 171.0):
        images = mirror_image(angles, plane)
        assert ((images >= 0) & (images < 180)).all()
        from_plane = angle_from_plane(angles, plane)
        np.testing.assert_allclose(angle_from_plane(images, plane), from_plane, atol=1e-12)
        # cos 2(θ - a) is what a mirror keeps
        doubled = np.cos(2 * np.deg2rad(angles - plane))
        np.testing.assert_allclose(np.cos(2 * np.deg2rad(from_plane)), doubled, atol=1e-12)
    assert angle_from_plane(83.4, 83.4) == 0
    assert angle_from_plane(173.4, 83.4) == pytest.approx(90)


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
