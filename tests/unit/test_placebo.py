"""One object under several names: recognised by its placement, and not in another session."""

from pathlib import Path

import numpy as np
import pytest

from ajgdata.acquire.recipe import plan_session, session_names
from ajgdata.acquire.virtual import VirtualGripper
from ajgdata.evaluate.crossval import cross_validate
from ajgdata.features.spectrum import spectrum
from ajgdata.gripper import SAMPLE_RATE_HZ
from ajgdata.paths import Paths
from ajgdata.store.responses import ResponseStore
from ajgdata.store.sessions import read_dataset

ROOT = Path(__file__).parents[2]
COARSE = {"dx_mm": 6.0, "decay_db": 30.0}


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """Return feature, name, grasp and session of the placebo of 80 mm spheres, on a coarse grid."""
    spec = read_dataset(Paths(ROOT), "placebo_sphere80")
    scene = {**spec.recipe.scene, "numerics": COARSE}
    recipe = spec.recipe.model_copy(update={"scene": scene, "samples_per_grasp": 1})
    solver = ResponseStore(tmp_path_factory.mktemp("responses"))
    rows = []
    for session in session_names(recipe):
        grasps = plan_session(recipe, spec.name, session, "")
        source = VirtualGripper(grasps[0].setup, solver, recipe.signal)
        for grasp in grasps:
            take = source.take(grasp, 0)
            feature = spectrum(take.samples, SAMPLE_RATE_HZ, spec.features)
            rows.append((feature, grasp.object, grasp.grasp_id, session))
    return [np.array(column) for column in zip(*rows, strict=True)]


def accuracy(recordings, groups):
    feature, name, _, _ = recordings
    result = cross_validate(
        feature, name, groups, kind="classification", model="linear_plain", folds=4
    )
    return result.scores.pooled["accuracy"]


def test_identical_objects_are_recognised_by_their_placement_only(recordings):
    """Chance is 25 %; 80 grasps have a standard error of 5 %."""
    _, _, grasp, session = recordings
    assert accuracy(recordings, grasp) > 0.25 + 2 * 0.05
    assert abs(accuracy(recordings, session) - 0.25) < 3 * 0.05
