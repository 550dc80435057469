"""Every data set that is declared here: what its recipe and tasks must keep to."""

import itertools
from collections import Counter
from pathlib import Path

import pytest

from ajgdata.acquire.recipe import session_names
from ajgdata.evaluate.mirror import angle_from_plane, mirror_plane
from ajgdata.experiments.requests import requested_experiments
from ajgdata.gripper.grippers import GRIPPERS
from ajgdata.paths import Paths
from ajgdata.pipeline.planned_grasps import planned_grasps
from ajgdata.store.sessions import list_datasets, read_dataset
from ajgdata.types import SESSION_COLUMNS

PATHS = Paths(Path(__file__).resolve().parents[2])
SPECS = {name: read_dataset(PATHS, name) for name in list_datasets(PATHS)}
SIMULATED = [name for name, spec in SPECS.items() if spec.recipe]
TASKS = [(name, task) for name in SIMULATED for task in SPECS[name].tasks]
WITHHOLDING = [(name, task) for name, task in TASKS if SPECS[name].tasks[task].withhold]
#: Targets that are angles from a mirror plane, and their data sets.
FROM_PLANE = {"angle_from_plane_deg"}
MIRRORED = ("orientation_fine", "orientation_unequal_radii", "orientation_eccentric")


@pytest.mark.parametrize("name", SIMULATED)
def test_every_grasp_of_a_recipe_is_a_scene_and_has_its_labels(name):
    spec = SPECS[name]
    sessions = session_names(spec.recipe)
    (grasps,) = planned_grasps(PATHS, spec, sessions[:1])
    assert all(not grasp.object and not grasp.targets for grasp in grasps[: spec.recipe.references])
    grasps = grasps[spec.recipe.references :]
    assert len(grasps) == spec.recipe.grasps_per_object * len(spec.recipe.objects)
    given = [target for target in spec.targets if target not in ("object", *SESSION_COLUMNS)]
    assert all(set(given) <= set(grasp.targets) for grasp in grasps)
    if "object" in spec.targets:
        assert all(g.targets.get("object", g.object) == g.object for g in grasps)


@pytest.mark.parametrize(("name", "task"), WITHHOLDING)
def test_withheld_values_are_spread_within_the_range(name, task):
    settings = SPECS[name].tasks[task]
    recipe = SPECS[name].recipe
    values = sorted({item.targets[settings.target] for item in recipe.objects})
    assert set(settings.withhold) <= set(values)
    steps = [value in settings.withhold for value in values]
    if settings.target in FROM_PLANE:  # an angle and its mirror image have nearly one value
        assert steps[::2] == steps[1::2]
        steps = steps[::2]
    places = [place for place, is_withheld in enumerate(steps) if is_withheld]
    assert len(places) >= 4
    assert not {0, len(steps) - 1} & set(places)
    gaps = [b - a for a, b in itertools.pairwise(places)]
    assert min(gaps) > 1  # each is between two known ones
    assert places[0] < len(steps) / 4 < 3 * len(steps) / 4 < places[-1] + 1


@pytest.mark.parametrize(("name", "task"), TASKS)
def test_tasks_have_more_groups_than_folds_in_every_class(name, task):
    settings = SPECS[name].tasks[task]
    recipe = SPECS[name].recipe
    assert settings.groups in ("grasp_id", "session_id")
    assert recipe.sessions * recipe.grasps_per_object >= settings.folds


@pytest.mark.parametrize(("name", "task"), TASKS)
def test_what_a_task_is_tested_on_has_its_target_and_features(name, task):
    settings = SPECS[name].tasks[task]
    requests = requested_experiments(SPECS[name], task)
    for other in {other for request in requests for other in request.other_sets}:
        assert SPECS[other].features == SPECS[name].features
        assert SPECS[other].targets[settings.target] == SPECS[name].targets[settings.target]
        assert _drawn_for(other) == _drawn_for(name)


def _drawn_for(name):
    """The data set whose grasps a recipe makes: a grasp of the same name is the same grasp."""
    return SPECS[name].recipe.grasps_of or name


@pytest.mark.parametrize("name", MIRRORED)
def test_angles_from_the_mirror_plane_follow_from_the_gripper_s_geometry(name):
    recipe = SPECS[name].recipe
    plane = mirror_plane(GRIPPERS[recipe.scene.get("gripper", "default")]).angle_deg
    assert [item.targets["angle_deg"] for item in recipe.objects] == [4.5 * n for n in range(40)]
    for item in recipe.objects:
        angle = item.targets["angle_deg"]
        assert item.grasp == {"angle_deg": angle}
        # Labels have two decimals.
        from_plane = pytest.approx(angle_from_plane(angle, plane), abs=0.01)
        assert item.targets["angle_from_plane_deg"] == from_plane
        is_of_paper = angle % 9 == 0 and angle <= 162
        assert item.targets["grid"] == ("paper" if is_of_paper else "between")
    assert Counter(item.targets["grid"] for item in recipe.objects)["paper"] == 19


def test_the_finer_grid_has_the_same_grasps_and_nothing_else_of_its_own():
    """Random fields are formulas of the place, hence of no grid (`gripper.random_fields`)."""
    own, fine = (
        [g.setup for g in planned_grasps(PATHS, SPECS[name], ["virtual-01"])[0]]
        for name in ("size", "size_fine")
    )
    assert fine == [{**setup, "numerics": {"dx_mm": 3.0}} for setup in own] and len(own) == 80
