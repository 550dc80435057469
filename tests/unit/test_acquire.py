"""Acquisition goes on where it stopped and ends with the same bytes; recipes are stable."""

from pathlib import Path

import numpy as np
import pytest

from ajgdata.acquire.recipe import RecipeGrasp, plan_session, session_names
from ajgdata.acquire.virtual import GraspError
from ajgdata.acquire.writer import acquire_session
from ajgdata.gripper import SimulatedRecording
from ajgdata.store.audio import read_audio
from ajgdata.store.sessions import read_recordings, read_session
from ajgdata.types import AudioSettings, Recipe

UNPLAYABLE_HZ = 666


class Tones:
    """A source whose grasps sound like tones; it can fail at a given take."""

    sample_rate_hz = 8000
    solved = 0

    def __init__(self, fail_at=None):
        self.fail_at = fail_at
        self.takes = []

    def excitation(self):
        return 0.5 * np.sin(np.arange(1000) ** 2 / 5000)

    def take(self, grasp, sample):
        if grasp.setup["hz"] == UNPLAYABLE_HZ:
            raise GraspError(grasp.grasp_id, "is out of reach", "move it")
        if len(self.takes) == self.fail_at:
            raise RuntimeError("the cable came off")
        self.takes.append((grasp.grasp_id, sample))
        phase = 2 * np.pi * np.arange(1000) / self.sample_rate_hz
        samples = 0.5 * np.sin(grasp.setup["hz"] * phase + sample)
        return SimulatedRecording(samples, clipped_count=int(sample == 1))

    def describe(self):
        return {"gripper": "fake", "medium": "air", "device": "none", "scene": {"a": 1}}


def grasp(name, hz, samples=2):
    placement = f"placement {name}"
    digest = f"digest of {hz}"
    return RecipeGrasp(name, placement, f"object {name}", samples, {"hz": hz}, {"hz": hz}, digest)


GRASPS = [grasp("g1", 500), grasp("g2", 600), grasp("g3", 700)]
NAMES = ["g1_1", "g1_2", "g2_1", "g2_2", "g3_1", "g3_2"]


def content(folder: Path) -> dict[str, bytes]:
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def test_what_a_session_holds(tmp_path):
    folder = tmp_path / "s1"
    acquire_session(folder, Tones(), GRASPS)
    recordings, findings = read_recordings(folder)
    assert findings == []
    assert [r.recording_id for r in recordings] == NAMES
    second = recordings[1]
    assert (second.grasp_id, second.sample, second.object) == ("g1", 1, "object g1")
    assert second.quality == "clipped"
    assert second.labels == {"hz": "500", "setup_sha256": "digest of 500"}
    read = read_audio(folder / second.file, AudioSettings(sample_rate_hz=8000)).samples
    wanted = Tones().take(GRASPS[0], 1).samples
    np.testing.assert_allclose(read, wanted, rtol=0, atol=2**-24 + 2**-25)  # half a code, float32
    session = read_session(folder)
    assert (session.source, session.gripper, session.medium) == ("virtual", "fake", "air")
    assert session.excitation.sha256


def test_goes_on_after_a_failure(tmp_path):
    whole = tmp_path / "whole" / "s1"
    folder = tmp_path / "s1"
    assert acquire_session(whole, Tones(), GRASPS) == (6, 0, {}, 0)
    with pytest.raises(RuntimeError, match="cable"):
        acquire_session(folder, Tones(fail_at=3), GRASPS)
    assert not (folder / "session.yaml").exists()
    again = Tones()
    assert acquire_session(folder, again, GRASPS) == (4, 2, {}, 0)  # a whole grasp is kept
    assert len(again.takes) == 4
    assert content(folder) == content(whole)
    assert acquire_session(folder, Tones(fail_at=0), GRASPS) == (0, 6, {}, 0)


def test_a_virtual_session_shrinks_with_its_recipe(tmp_path):
    folder = tmp_path / "s1"
    acquire_session(folder, Tones(), GRASPS)
    fewer = [GRASPS[0], grasp("g3", 700, samples=1)]
    assert acquire_session(folder, Tones(), fewer) == (0, 3, {}, 0)
    names = [r.recording_id for r in read_recordings(folder)[0]]
    assert names == ["g1_1", "g1_2", "g3_1"]
    assert sorted(path.stem for path in (folder / "audio").iterdir()) == names


def test_a_grasp_that_cannot_be_made_is_named_and_the_rest_goes_on(tmp_path):
    folder = tmp_path / "s1"
    source = Tones()
    bad = grasp("g2", UNPLAYABLE_HZ)
    all_three = [GRASPS[0], bad, GRASPS[2]]
    done = acquire_session(folder, source, all_three)
    assert done == (4, 0, {"g2": "is out of reach; move it"}, 0)
    assert [r.recording_id for r in read_recordings(folder)[0]] == ["g1_1", "g1_2", "g3_1", "g3_2"]
    assert read_session(folder).skipped == done.skipped
    before = content(folder)
    assert acquire_session(folder, Tones(), all_three) == (0, 4, done.skipped, 0)
    assert content(folder) == before
    # What was recorded of it when it could be made is not its recording any more.
    assert acquire_session(folder, Tones(), GRASPS) == (2, 4, {}, 0)
    assert acquire_session(folder, Tones(), all_three)[:2] == (0, 4)
    assert content(folder) == before


BASE = {
    "seed": 1,
    "sessions": 2,
    "grasps_per_object": 2,
    "vary": {"angle_deg": [-10, 10], "offset_x_mm": [0, 2]},
    "scene": {"grasp": {"force_n": 3}, "numerics": {"dx_mm": 6}},
    "objects": [{"name": n, "shape": {"kind": "cube"}, "targets": {}} for n in ("a", "b")],
}


def grasps(**changes):
    recipe = Recipe.model_validate(BASE | changes)
    return {
        g.grasp_id: g
        for session in session_names(recipe)
        for g in plan_session(recipe, "d", session, "code")
    }


def test_a_recipe_that_grows_changes_no_grasp():
    before = grasps()
    assert len(before) == 8
    more = [*BASE["objects"], {"name": "c", "shape": {"kind": "ball"}}]
    for changes in (
        {"objects": more[::-1]},
        {"grasps_per_object": 12, "sessions": 101, "samples_per_grasp": 9},
    ):
        after = grasps(**changes)
        for name, entry in before.items():
            assert (after[name].digest, after[name].setup) == (entry.digest, entry.setup)


def test_what_enters_a_grasp():
    plan = grasps()
    for entry in plan.values():
        drawn = entry.setup["grasp"]
        assert drawn["force_n"] == 3
        assert -10 <= drawn["angle_deg"] <= 10
        assert 0 <= drawn["offset_x_mm"] <= 2
        assert entry.setup["numerics"] == {"dx_mm": 6}
        assert entry.setup["object"] == {"kind": "cube"}
    assert len({g.digest for g in plan.values()}) == len(plan)
    recipe = Recipe.model_validate(BASE)
    other = plan_session(recipe, "d", "virtual-01", "other code")
    assert not {g.digest for g in other} & {g.digest for g in plan.values()}
    fixed = grasps(vary={"angle_deg": [5, 5]})
    assert {g.setup["grasp"]["angle_deg"] for g in fixed.values()} == {5}


def test_several_grippers_each_with_references():
    setups = {"small": {"gripper": "small"}, "coffee": {"medium": {"kind": "coffee"}}}
    recipe = Recipe.model_validate(
        BASE | {"variants": setups, "references": 2, "sessions": 1, "same_grasps": False}
    )
    assert session_names(recipe) == ["virtual-small-01", "virtual-coffee-01"]
    small = plan_session(recipe, "d", "virtual-small-01", "code")
    assert [g.object for g in small] == ["", "", "a", "b", "a", "b"]
    assert [g.grasp_id for g in small[:2]] == [f"virtual-small-01_empty_{n:02d}" for n in (1, 2)]
    for reference in small[:2]:
        assert reference.setup["object"] is None
        assert reference.targets == {}
        assert set(reference.setup["grasp"]) == {"force_n", "seed"}
    assert all(g.setup["gripper"] == "small" and "medium" not in g.setup for g in small)
    coffee = plan_session(recipe, "d", "virtual-coffee-01", "code")
    assert all(g.setup["medium"] == {"kind": "coffee"} for g in coffee)
    seeds = [g.setup["grasp"]["seed"] for g in (*small, *coffee)]
    assert len(set(seeds)) == len(seeds)
