"""Data sets that are derived from another, and those that a task is tested on."""

import pytest
import yaml

from ajgdata.acquire.recipe import plan_session
from ajgdata.paths import Paths
from ajgdata.store.sessions import read_dataset
from ajgdata.types import DataError

BASE = {
    "name": "base",
    "licence": "CC0-1.0",
    "targets": {"edge_mm": {"kind": "regression", "unit": "mm"}},
    "tasks": {"size": {"target": "edge_mm", "test_on": ["loud"]}},
    "recipe": {
        "grasps_per_object": 2,
        "vary": {"offset_x_mm": [-2, 2]},
        "scene": {"medium": {"kind": "metal"}, "grasp": {"force_n": 6}},
        "objects": [
            {"name": "a", "shape": "cube_10p0", "targets": {"edge_mm": 10}},
            {
                "name": "b",
                "shape": "cube_20p7",
                "targets": {"edge_mm": 20.7},
                "grasp": {"angle_deg": 9},
            },
        ],
    },
}
LOUD = {"name": "loud", "from": "base", "recipe": {"signal": {"external_noise_dba": 80}}}


@pytest.fixture
def paths(tmp_path):
    layout = Paths(tmp_path)
    for content in (BASE, LOUD):
        declare(layout, content)
    return layout


def declare(paths, content):
    path = paths.dataset(content["name"])
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(yaml.safe_dump(content, sort_keys=False))


def test_a_derived_data_set_makes_the_same_grasps_and_takes_over_all_but_the_tasks(paths):
    base = read_dataset(paths, "base")
    loud = read_dataset(paths, "loud")
    assert (loud.licence, loud.targets, loud.tasks) == (base.licence, base.targets, {})
    assert loud.recipe.signal == {"external_noise_dba": 80}
    assert loud.recipe.scene == base.recipe.scene
    sessions = [plan_session(d.recipe, d.name, "virtual-01", "c") for d in (base, loud)]
    assert [g.setup for g in sessions[0]] == [g.setup for g in sessions[1]]
    assert [g.grasp_id for g in sessions[0]] == [g.grasp_id for g in sessions[1]]
    assert not {g.digest for g in sessions[0]} & {g.digest for g in sessions[1]}


def test_a_mapping_is_joined_and_anything_else_replaced(paths):
    declare(paths, LOUD | {"recipe": {"scene": {"grasp": {"force_n": 4}}, "objects": []}})
    with pytest.raises(DataError, match=r"recipe.objects"):
        read_dataset(paths, "loud")
    declare(paths, LOUD | {"recipe": {"scene": {"grasp": {"force_n": 4}}, "grasps_per_object": 1}})
    recipe = read_dataset(paths, "loud").recipe
    assert recipe.scene == {"medium": {"kind": "metal"}, "grasp": {"force_n": 4}}
    assert (recipe.grasps_per_object, len(recipe.objects)) == (1, 2)


@pytest.mark.parametrize(
    ("origin", "problem"),
    [
        ("nothing", "there is no "),
        ("loud", "'loud' is itself derived"),
    ],
)
def test_what_cannot_be_derived_from_is_said(paths, origin, problem):
    declare(paths, {"name": "third", "from": origin})
    with pytest.raises(DataError, match=rf"third/dataset.yaml:2: from = .*{problem}"):
        read_dataset(paths, "third")
