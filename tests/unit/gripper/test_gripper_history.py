"""Beds that remember the grasp before, grippers that came out askew, grains that bear an object."""

import numpy as np
import pytest

from ajgdata.gripper.geometry import grasp_cavity
from ajgdata.gripper.random_fields import normals
from ajgdata.gripper.scene import History, Scene, actual_scene

CALM = {
    "roughness_mm": 0,
    "slope_deg": 0,
    "packing": 0,
    "force": 0,
}
NUMBERS = 6


def scene(**changes) -> Scene:
    grasp = {"nuisance": CALM} | changes.pop("grasp", {})
    return Scene.model_validate({"object": "cube_20p7", "grasp": grasp, **changes})


@pytest.mark.parametrize(("memory", "start", "beds"), [(0, 0, 200), (0.475, 1_000, 50)])
def test_numbers_of_a_history_keep_their_variance_and_forget_by_their_memory(memory, start, beds):
    """Of n numbers, 10 a bed: a variance of 1 errs by √(2/n), a correlation by √(1/n)
    at most; 5 of these. What is cut off changes either by less than 0.001."""
    drawn = (
        np.array(
            [
                [
                    normals(0, "slope", 10, History(seed=seed, number=start + n, memory=memory))
                    for n in range(NUMBERS)
                ]
                for seed in range(beds)
            ]
        )
        .transpose(1, 0, 2)
        .reshape(NUMBERS, -1)
    )
    count = drawn.shape[1]
    assert np.mean(drawn**2, axis=1) == pytest.approx(1, abs=5 * np.sqrt(2 / count) + 1e-3)
    for lag in range(1, NUMBERS):
        correlation = np.mean(drawn[0] * drawn[lag])
        assert correlation == pytest.approx(memory**lag, abs=5 * np.sqrt(2 / count) + 1e-3)


def test_a_balloon_askew_keeps_rim_and_volume_and_moves_its_tip():
    straight, askew = (
        grasp_cavity(
            Scene.model_validate({"assembly": {"askew_mm": tip}, "grasp": {"nuisance": CALM}})
        )
        for tip in ((0, 0), (4, -3))
    )
    x, y = np.meshgrid(straight.axis, straight.axis)
    outside = np.hypot(x, y) >= 0.05
    assert np.all(askew.floor[outside] == 0)
    deepest = np.unravel_index(np.argmin(askew.floor), askew.floor.shape)
    # x = a (1 - x²/R²) at the tip: 0.96 and 0.97 mm less of 4 and 3 mm, on a raster of 0.5 mm.
    assert (x[deepest], y[deepest]) == pytest.approx((4e-3, -3e-3), abs=5.5e-4)
    assert askew.floor.min() == pytest.approx(-0.045, rel=1e-3)
    # To first order in askew / R = 0.1 volume stays: (a/R)² = 0.01 of it may go.
    assert askew.floor.sum() == pytest.approx(straight.floor.sum(), rel=0.01)


def test_what_came_out_otherwise_is_as_if_it_had_been_meant():
    came_out = scene(
        gripper={"speaker_mm": [-35, 3]},
        assembly={"speaker_moved_mm": [0.5, -1], "microphone_moved_mm": [0, 1]},
        session={"jig_mm": [2, -1], "temperature_k": 1.5, "fill_mm": -3},
        grasp={"offset_x_mm": 1, "angle_deg": 9, "placed_mm": [0.5, 0.25], "placed_deg": -1},
    )
    meant = scene(
        gripper={"speaker_mm": [-34.5, 2], "microphone_mm": [34, -4], "bed_depth_mm": 32},
        environment={"temperature_c": 23.5},
        grasp={"offset_x_mm": 3.5, "offset_y_mm": -0.75, "angle_deg": 8},
    )
    assert actual_scene(came_out) == actual_scene(meant) == meant
    result = grasp_cavity(came_out)
    expected = grasp_cavity(meant)
    assert np.array_equal(result.floor, expected.floor)
    assert np.array_equal(result.surface, expected.surface)
