"""What a run is about: declared data sets with sessions or a recipe, and nothing written twice."""

import pytest
import yaml

from ajgdata.acquire.recipe import recipe_hash, session_names
from ajgdata.experiments.requests import requests_for
from ajgdata.paths import Paths
from ajgdata.pipeline.plan import plan
from ajgdata.pipeline.planned_grasps import planned_grasps
from ajgdata.store.sessions import read_dataset, write_session
from ajgdata.types import DataError, Recording, Session

RECIPE = {
    "sessions": 2,
    "grasps_per_object": 1,
    "objects": [{"name": "a", "shape": {"kind": "cube", "edge_mm": 10}}],
}


def declare(paths, name, **keys):
    path = paths.dataset(name)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(yaml.safe_dump({"name": name, **keys}))


def hold(paths, name, session, source="import"):
    recording = Recording(recording_id="1", file="audio/1.wav", grasp_id="1")
    folder = paths.session(name, session)
    write_session(folder, Session(session_id=session, source=source), [recording])


def test_only_what_has_sessions_or_a_recipe_is_run(tmp_path):
    paths = Paths(tmp_path)
    declare(paths, "waiting")
    declare(paths, "imported")
    declare(paths, "made", recipe=RECIPE)
    hold(paths, "imported", "day1")
    plans = plan(paths)
    assert {name: entry.sessions for name, entry in plans.items()} == {
        "imported": ("day1",),
        "made": ("virtual-01", "virtual-02"),
    }
    assert list(plan(paths, ["imported"])) == ["imported"]
    assert not paths.results.exists()  # nothing is written unless it is asked for


def scenes(paths, session):
    """The grasps that the recipe plans for a session."""
    (grasps,) = planned_grasps(paths.dataset("made"), read_dataset(paths, "made"), [session])
    return grasps


def test_variants_are_sessions_of_the_same_grasps(tmp_path):
    paths = Paths(tmp_path)
    variants = {"air": {"medium": {"kind": "air"}}, "thick": {"gripper": "thick-membrane"}}
    declare(paths, "made", recipe={**RECIPE, "vary": {"angle_deg": [0, 9]}, "variants": variants})
    sessions = plan(paths, check=True)["made"].sessions
    assert sessions == tuple(f"virtual-{v}-0{n}" for v in variants for n in (1, 2))
    grasps = [scenes(paths, name)[0] for name in sessions]
    setups = [grasp.setup for grasp in grasps]
    assert [setup["grasp"] for setup in setups[:2]] == [setup["grasp"] for setup in setups[2:]]
    assert setups[0]["grasp"] != setups[1]["grasp"]
    assert [setup.get("medium") for setup in setups] == [{"kind": "air"}] * 2 + [None] * 2
    assert [setup.get("gripper") for setup in setups] == [None] * 2 + ["thick-membrane"] * 2
    assert len({grasp.grasp_id for grasp in grasps}) == 4


def test_blocks_of_one_object_share_a_placement_and_rounds_do_not(tmp_path):
    """The draws of one placement are those of recipes without the key."""
    paths = Paths(tmp_path)
    two = [{"name": name, "shape": {"kind": "cube", "edge_mm": 10}} for name in "ab"]
    recipe = {**RECIPE, "objects": two, "grasps_per_object": 4, "variation": {}}

    def planned(**keys):
        declare(paths, "made", recipe={**recipe, **keys})
        grasps = scenes(paths, "virtual-01")
        order = "".join(grasp.object for grasp in grasps)
        own = [grasp for grasp in grasps if grasp.object == "a"]
        placed = [tuple(grasp.setup["grasp"]["placed_mm"]) for grasp in own]
        names = [grasp.placement_id for grasp in own]
        # one name for one draw
        assert len(set(zip(names, placed, strict=True))) == len(set(names)) == len(set(placed))
        return order, names, placed

    once = planned(order="blocks")
    assert once[:2] == ("aaaabbbb", ["virtual-01_a_placement_01"] * 4)
    twice = planned(order="blocks", placements=2)
    assert (twice[0], len(set(twice[1]))) == ("aabbaabb", 2)
    uneven = planned(order="blocks", placements=3)
    assert [uneven[1].count(name) for name in dict.fromkeys(uneven[1])] == [2, 1, 1]
    rounds = planned(order="rounds")
    assert (rounds[0], len(set(rounds[1]))) == ("abababab", 4)
    assert planned(order="blocks", placements=4) == rounds


def test_more_placements_than_grasps_are_refused(tmp_path):
    paths = Paths(tmp_path)
    declare(paths, "made", recipe={**RECIPE, "order": "blocks", "placements": 2})
    with pytest.raises(DataError, match="placements 2 needs as many grasps_per_object: it is 1"):
        read_dataset(paths, "made")
    declare(paths, "made", recipe={**RECIPE, "grasps_per_object": 2, "placements": 2})
    with pytest.raises(DataError, match="placements needs `order: blocks`"):
        read_dataset(paths, "made")


def test_simulated_and_recorded_sessions_do_not_meet_in_one_data_set(tmp_path):
    """The features of both would be labelled simulated."""
    paths = Paths(tmp_path)
    declare(paths, "both", recipe=RECIPE)
    hold(paths, "both", "day1")
    said = "both/sessions: its recipe is simulated, session day1 is recorded.*Move day1 below"
    with pytest.raises(DataError, match=said):
        plan(paths, check=True)


def test_what_a_task_is_tested_on_comes_with_it(tmp_path):
    paths = Paths(tmp_path)
    tasks = {"t": {"target": "object", "test_on": ["one"]}}
    targets = {"object": {"kind": "classification"}}
    declare(paths, "many", targets=targets, tasks=tasks, recipe=RECIPE)
    with pytest.raises(DataError, match=r"no such data set. Use one of many"):
        plan(paths, ["many"])
    declare(paths, "one")
    with pytest.raises(DataError, match=r"one/sessions: holds no sessions. Get some with"):
        plan(paths, ["many"])
    with pytest.raises(DataError, match="needs the data set 'one', which holds no sessions"):
        plan(paths)  # where nobody asked for `one`
    hold(paths, "one", "day1")
    assert list(plan(paths, ["many"])) == ["many", "one"]


def test_variants_that_wait_for_everything_bring_no_data_sets(tmp_path):
    paths = Paths(tmp_path)
    task = {"t": {"target": "object", "models": []}}
    targets = {"object": {"kind": "classification"}}
    for name in ("many", "one"):
        declare(paths, name, targets=targets, tasks=task, recipe=RECIPE)
    file = {
        "title": "T",
        "question": "Q",
        "train": "many",
        "task": "t",
        "models": ["knn_plain"],
        "variants": {"a": {}, "b": {"train": ["one"]}},
    }
    paths.variants.mkdir(parents=True)
    (paths.variants / "v.yaml").write_text(yaml.safe_dump(file))
    assert list(plan(paths, ["many"])) == ["many", "one"]
    hypothesis = {"claim": "C", "change": "D", "before": "a", "after": "b"}
    (paths.variants / "v.yaml").write_text(yaml.safe_dump(file | {"hypotheses": [hypothesis]}))
    planned = plan(paths, ["many"])
    assert list(planned) == ["many"]
    specs = {name: item.spec for name, item in planned.items()}
    assert requests_for(specs, [("many", "t")]) == []


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"vary": {"roll": [0, 1]}}, "dataset.yaml: recipe, a: unknown key grasp.roll"),
        (
            {"scene": {"grasp": {"offset_x_mm": 99}}},
            "dataset.yaml: recipe, a: content: the object's centre lies outside",
        ),
        ({"signal": {"gain": 3}}, r"dataset.yaml:\d+: recipe, signal: unknown key gain"),
        (
            {"order": "blocks", "variation": {"grasp": {"memory": 1.0}}},
            r"dataset.yaml:\d+: recipe, variation.*grasp.memory",
        ),
    ],
)
def test_a_scene_that_cannot_be_is_said_before_anything_is_written(tmp_path, change, said):
    paths = Paths(tmp_path)
    declare(paths, "made", recipe=RECIPE | change)
    with pytest.raises(DataError, match=said):
        plan(paths, check=True)


def test_a_session_follows_from_its_part_of_the_recipe(tmp_path):
    paths = Paths(tmp_path)
    spec = {"recipe": {**RECIPE, "variants": {"a": {}, "b": {}}}}

    def hashes(**changes):
        declare(paths, "made", **{**spec, **changes})
        dataset = read_dataset(paths, "made")
        names = session_names(dataset.recipe)
        return {name: recipe_hash(dataset.recipe, name, dataset.excitation) for name in names}

    first = hashes()
    more = hashes(recipe={**spec["recipe"], "sessions": 3})
    assert first.items() < more.items()
    thick = {"a": {}, "b": {"gripper": "thick-membrane"}}
    changed = hashes(recipe={**RECIPE, "variants": thick})
    assert {name for name in first if changed[name] != first[name]} == {
        "virtual-b-01",
        "virtual-b-02",
    }
    for change in ({"recipe": {**spec["recipe"], "seed": 9}}, {"excitation": {"kind": "mls"}}):
        assert not set(hashes(**change).values()) & set(first.values())
