"""An angle and its mirror image give the same sound if the gripper equals its mirror image."""

import numpy as np
from mirror_symmetry import mirror_plane

from ajgdata.features.spectrum import spectrum
from ajgdata.gripper import (
    SAMPLE_RATE_HZ,
    Scene,
    SignalChain,
    excitation_sweep,
    record,
    simulate,
)
from ajgdata.gripper.grippers import GRIPPERS
from ajgdata.types import FeatureSettings

QUIET = SignalChain(noise_db_spl=None)
CALM = {"roughness_mm": 0, "slope_deg": 0, "packing": 0, "force": 0, "temperature_k": 0}


def response(gripper, angle, held, **numerics):
    grasp = {"angle_deg": angle, "nuisance": CALM}
    scene = {"object": held, "gripper": gripper, "grasp": grasp, "numerics": numerics}
    return simulate(Scene.model_validate(scene))


def test_a_symmetric_gripper_gives_mirror_images_the_same_response():
    coarse = {"dx_mm": 6, "precision": "float64", "max_time_s": 0.02}
    one, other = (response("symmetric", a, "marker", **coarse).samples for a in (30.0, -30.0))
    # 2,700 steps that round to 1e-16 of the largest value each, in another order.
    assert np.linalg.norm(one - other) < 2_700 * 1e-16 * np.linalg.norm(one)


def distance(gripper):
    """Return the relative L2 distance between the features at 45° on both sides of the plane."""
    plane = mirror_plane(GRIPPERS[gripper]).angle_deg
    one, image = (
        spectrum(
            record(
                response(gripper, plane + side, "bar", dx_mm=5), excitation_sweep(), QUIET
            ).samples,
            SAMPLE_RATE_HZ,
            FeatureSettings(),
        )
        for side in (45.0, -45.0)
    )
    return np.linalg.norm(one - image) / np.linalg.norm(one)


def test_transducers_of_unequal_radii_break_the_mirror():
    """Misfits are 10.6 mm against 0.8 mm."""
    assert distance("unequal-radii") > 3 * distance("default")
