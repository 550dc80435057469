"""The virtual gripper in live use: takes as the recipe records them, of grasps that it does not."""

import numpy as np
import pytest

from ajgdata import gripper
from ajgdata.acquire.recipe import new_setup
from ajgdata.acquire.virtual import VirtualTable
from ajgdata.gripper import SignalChain, derive_seed, excitation_sweep
from ajgdata.store.responses import ResponseStore
from ajgdata.types import DataError, Recipe, checked

SWEEP = excitation_sweep(duration_s=0.3).astype(np.float32)
RECIPE = Recipe.model_validate(
    {
        "grasps_per_object": 2,
        "scene": {"numerics": {"dx_mm": 6, "max_time_s": 0.006}},
        "vary": {"angle_deg": [-20, 20]},
        "objects": [
            {"name": "cube", "shape": {"kind": "cube", "edge_mm": 20}, "grasp": {"force_n": 7}},
            {"name": "ball", "shape": {"kind": "sphere", "diameter_mm": 30}},
        ],
    }
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("responses")


def test_a_take_is_what_the_simulation_records(folder):
    table = VirtualTable(RECIPE, 3, folder)
    table.place("cube", 1, "g1")
    seeds = derive_seed(3, "pose", "cube", 1), derive_seed(3, "grasp", "cube", "g1")
    scene = checked(gripper.Scene, "g1", new_setup(RECIPE, "cube", *seeds, (3, "new")))
    response = ResponseStore(folder).solve(scene)
    noise = derive_seed(3, "noise", 1)
    expected = gripper.record(response, SWEEP, SignalChain(), noise).samples
    taken = table.take(SWEEP)
    np.testing.assert_array_equal(taken.samples, expected.astype(np.float32))
    assert (taken.xruns, taken.attempts, taken.latency_samples) == (0, 1, 0)


def test_what_cannot_be_played_or_grasped_is_named(folder):
    silent = RECIPE.model_copy(update={"signal": {"level_db_spl": None}})
    with pytest.raises(DataError, match="silent"):
        VirtualTable(silent, 0, folder)
    with pytest.raises(DataError, match="objects: the recipe has no object 'rod': it has cube"):
        VirtualTable(RECIPE, 0, folder).place("rod", 1, "g")
