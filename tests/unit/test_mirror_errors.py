"""Mirror planes, and predictions that confuse an angle with its mirror image."""

import math
from pathlib import Path

import numpy as np
import pytest

from ajgdata.evaluate.mirror import (
    angle_from_plane,
    mirror_errors,
    mirror_image,
    mirror_p,
    mirror_plane,
    mirror_planes,
)
from ajgdata.gripper.grippers import GRIPPERS, Gripper
from ajgdata.paths import Paths
from ajgdata.store.files import read_model
from ajgdata.types.variants import Variants

PLANE_DEG = 90.0
ANGLES = np.repeat(np.arange(9.0, 180.0, 18.0), 4)
FOLD = np.tile([0, 1], len(ANGLES) // 2)


def test_transducers_on_one_diameter_at_equal_radii_have_two_planes_of_misfit_0():
    kept, exchanged = mirror_planes(Gripper(speaker_mm=(-30, 0), microphone_mm=(30, 0)))
    assert kept == pytest.approx((0, 0), abs=1e-12)
    assert exchanged == pytest.approx((90, 0))
    assert mirror_plane(GRIPPERS["default"]).misfit_mm < 1
    assert mirror_plane(GRIPPERS["unequal-radii"]).misfit_mm > 10


def test_an_angle_and_its_mirror_image_are_equally_far_from_the_plane():
    images = mirror_image(ANGLES, PLANE_DEG)
    assert images.min() >= 0 and images.max() < 180
    assert mirror_image(images, PLANE_DEG) == pytest.approx(ANGLES)
    for angle, image in zip(ANGLES, images, strict=True):
        assert angle_from_plane(image, PLANE_DEG) == pytest.approx(
            angle_from_plane(angle, PLANE_DEG)
        )


def test_half_of_the_predictions_at_the_mirror_image():
    """Each fold has 3° of error to the nearer angle, and the other half is at the image."""
    at_image = np.arange(len(ANGLES)) % 4 < 2
    predicted = np.where(at_image, mirror_image(ANGLES, PLANE_DEG), ANGLES) + 3.0
    errors = mirror_errors(ANGLES, predicted, FOLD, PLANE_DEG)
    assert errors.nearer_error == pytest.approx(3.0)
    assert errors.error > 50
    assert errors.share == pytest.approx(0.5)
    assert mirror_p(ANGLES, predicted, FOLD, PLANE_DEG) == 0.001  # none of 999 permutations


def test_errors_without_a_mirror_image_do_not_support_it():
    right = mirror_errors(ANGLES, ANGLES, FOLD, PLANE_DEG)
    assert right == (0, 0, 0) and mirror_p(ANGLES, ANGLES, FOLD, PLANE_DEG) == 1
    near = ANGLES + np.random.default_rng(0).normal(0, 2, len(ANGLES))
    assert mirror_p(ANGLES, near, FOLD, PLANE_DEG) > 0.5
    p = [
        mirror_p(ANGLES, np.repeat(np.random.default_rng(n).uniform(0, 180, 10), 4), FOLD, 80.0)
        for n in range(40)
    ]
    assert np.mean(np.array(p) < 0.05) < 0.2  # a guess is rejected in 5 % of all cases


def test_errors_of_a_period_are_the_shortest_way_round():
    true = np.array([1.0, 1.0])
    predicted = np.array([179.0, 179.0])
    assert mirror_errors(true, predicted, np.zeros(2), 45.0, period=180.0).error == 2
    assert mirror_errors(true, predicted, np.zeros(2), 45.0).error == 178


def test_the_transducers_of_the_grid_have_the_misfit_of_its_axis_for_both_planes():
    paths = Paths(Path(__file__).resolve().parents[2])
    file = read_model(paths.variants / "breaking_mirror.yaml", Variants)
    for variant in file.all_variants:
        misfit_mm = file.x(variant)
        gripper = Gripper(**variant.change.grasps.scene["gripper"])
        planes = mirror_planes(gripper)
        assert [plane.misfit_mm for plane in planes] == pytest.approx([misfit_mm] * 2, abs=0.01)
        assert planes[1].angle_deg == pytest.approx(83.4, abs=0.01)  # that of the default gripper
        assert math.dist(gripper.speaker_mm, gripper.microphone_mm) == pytest.approx(70, abs=0.02)
        offset_mm = float(file.series(variant))
        assert variant.change.grasps.scene["session"]["jig_mm"] == [offset_mm, offset_mm]
