"""An angle and its mirror image give the same sound if the gripper equals its mirror image."""

import numpy as np

from ajgdata.gripper import (
    Scene,
    simulate,
)

CALM = {"roughness_mm": 0, "slope_deg": 0, "packing": 0, "force": 0}


def test_a_symmetric_gripper_gives_mirror_images_the_same_response():
    coarse = {"dx_mm": 6, "precision": "float64", "max_time_s": 0.02}
    image, other = (
        simulate(
            Scene.model_validate(
                {
                    "object": "marker",
                    "gripper": "symmetric",
                    "grasp": {"angle_deg": angle, "nuisance": CALM},
                    "numerics": coarse,
                }
            )
        ).samples
        for angle in (30.0, -30.0)
    )
    # 2,700 steps that round to 1e-16 of the largest value each, in another order.
    assert np.linalg.norm(image - other) < 2_700 * 1e-16 * np.linalg.norm(image)
