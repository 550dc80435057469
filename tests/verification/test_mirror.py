"""Under a symmetric gripper an angle and its mirror image sound the same, else they do not."""

import numpy as np
import pytest

from ajgdata.gripper import Scene, simulate

CALM = {"roughness_mm": 0, "slope_deg": 0, "packing": 0, "force": 0, "temperature_k": 0}


def _response(gripper, angle):
    scene = {
        "object": "marker",
        "gripper": gripper,
        "grasp": {"angle_deg": angle, "nuisance": CALM},
        "numerics": {"dx_mm": 6, "precision": "float64", "max_time_s": 0.02},
    }
    return simulate(Scene.model_validate(scene)).samples


def _difference(gripper):
    one, other = _response(gripper, 30.0), _response(gripper, -30.0)
    return np.linalg.norm(one - other) / np.linalg.norm(one)


def test_a_symmetric_gripper_cannot_tell_mirror_images():
    # 2,700 steps that round to 1e-16 of the largest value each, in another order.
    assert _difference("symmetric") < 2_700 * 1e-16


@pytest.mark.parametrize("gripper", ["default", "asymmetric"])
def test_the_others_can(gripper):
    # A re-recording moves the response by less than 0.01.
    assert _difference(gripper) > 0.1
