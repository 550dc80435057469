"""Recordings that a page plays: the first of some values, and nothing but what was measured."""

import pytest
from worlds import write_tone

from ajgdata.pipeline import report
from ajgdata.pipeline.report import clips_of
from ajgdata.store.sessions import read_dataset
from ajgdata.types import Recording, Target

TARGETS = {
    "object": Target(kind="classification"),
    "edge_mm": Target(kind="regression", unit="mm"),
}


@pytest.fixture
def made(project):
    """Four tones: a box in two grasps, and two other objects."""
    project.declare(
        targets={name: target.model_dump() for name, target in TARGETS.items()},
        tasks={"thing": {"target": "object"}, "edge": {"target": "edge_mm"}},
    )
    audio = project.folder() / "audio"
    given = [("box 1", "box", "g1", 500), ("b2", "box", "g2", 510), ("c", "<i>", "g3", 520)]
    given.append(("d", "door", "g4", 1500))
    project.write([
        Recording(
            recording_id=name, file=f"audio/{name}.wav", grasp_id=grasp, object=thing,
            sha256=write_tone(audio / f"{name}.wav", hz), labels={"edge_mm": str(hz)},
        )
        for name, thing, grasp, hz in given
    ])  # fmt: skip
    project.shard()
    store, _ = project.merge("s1", targets=TARGETS)
    return project, read_dataset(project.paths, "d"), store


def test_the_first_recording_of_each_class_is_copied_unchanged(made, tmp_path):
    project, spec, store = made
    clips = clips_of(project.paths, spec, store, tmp_path / "sounds", "thing")
    shown = [(clip.label, clip.recording) for clip in clips]
    assert shown == [("<i>", "s1/c"), ("box", "s1/b2"), ("door", "s1/d")]
    for clip in clips:
        own = project.folder() / "audio" / f"{clip.recording.split('/')[1]}.wav"
        assert (tmp_path / clip.file).read_bytes() == own.read_bytes()
    assert len(list((tmp_path / "sounds").iterdir())) == 3


def test_values_are_spaced_evenly_and_have_a_unit(made, tmp_path, monkeypatch):
    project, spec, store = made
    monkeypatch.setattr(report, "MAX_CLIPS", 2)
    clips = clips_of(project.paths, spec, store, tmp_path, "edge")
    assert [clip.label for clip in clips] == ["500 mm", "1,500 mm"]


def test_a_task_with_some_classes_plays_these_alone(made, tmp_path):
    project, spec, store = made
    some = spec.tasks["thing"].model_copy(update={"classes": ("door", "box")})
    spec = spec.model_copy(update={"tasks": {**spec.tasks, "some": some}})
    clips = clips_of(project.paths, spec, store, tmp_path, "some")
    assert [clip.label for clip in clips] == ["box", "door"]


@pytest.mark.parametrize("gone", ["file", "bytes", "table"])
def test_a_recording_that_is_missing_or_changed_is_not_played(made, tmp_path, gone):
    project, spec, store = made
    path = project.folder() / "audio" / "c.wav"
    if gone == "file":
        path.unlink()
    elif gone == "bytes":
        write_tone(path, 521)
    else:
        project.paths.recordings_file("d", "s1").unlink()
    clips = clips_of(project.paths, spec, store, tmp_path, "thing")
    assert [clip.label for clip in clips] == ([] if gone == "table" else ["box", "door"])
