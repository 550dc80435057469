"""Importing again: new recordings are added, differences are listed, --on-change takes them."""

import pytest
from worlds import write_tone

from ajgdata.paths import Paths
from ajgdata.pipeline.importing import import_folder
from ajgdata.store.sessions import (
    list_sessions,
    read_recordings,
    write_recordings,
)


@pytest.fixture
def paths(tmp_path):
    (tmp_path / "project" / "datasets").mkdir(parents=True)
    return Paths(tmp_path / "project")


@pytest.fixture
def days(tmp_path):
    """Two days, each a session by its folder, two recordings each."""
    folder = tmp_path / "days"
    for number, name in enumerate(("mon/1_cube", "mon/2_ball", "tue/1_cube", "tue/2_ball")):
        write_tone(folder / f"{name}.wav", 200 + 50 * number)
    return folder


def run(paths, folder, **options):
    settings = options.pop("settings", None)
    return import_folder(paths, "d", folder, settings=settings, **options)[2]


def rows(paths, session):
    return {r.recording_id: r for r in read_recordings(paths.session("d", session))[0]}


def correct(paths, session, name, **cells):
    held = rows(paths, session)
    own = {c: text for c, text in cells.items() if c in ("grasp_id", "quality", "object")}
    labels = {c: text for c, text in cells.items() if c not in own}
    row = held[name]
    held[name] = row.model_copy(update={**own, "labels": {**row.labels, **labels}})
    write_recordings(paths.session("d", session), list(held.values()))


def assert_all_in_tables(paths):
    for session in list_sessions(paths, "d"):
        folder = paths.session("d", session)
        there = {str(p.relative_to(folder)) for p in (folder / "audio").rglob("*") if p.is_file()}
        assert there == {row.file for row in read_recordings(folder)[0]}


def test_a_corrected_label_stays_and_is_named(paths, days):
    run(paths, days)
    correct(paths, "mon", "mon/2_ball", label="bowl", grasp_id="g7")
    result = run(paths, days)
    assert (result.changed, result.unchanged) == (0, 4)
    assert result.differing == [
        "mon/2_ball: label 'bowl' here, 'ball' in the folder",
        "mon/2_ball: grasp_id 'g7' here, 'mon/2_ball' in the folder",
    ]
    row = rows(paths, "mon")["mon/2_ball"]
    assert (row.labels["label"], row.grasp_id) == ("bowl", "g7")
    result = run(paths, days, on_change="labels")
    assert (result.changed, result.differing) == (1, [])
    row = rows(paths, "mon")["mon/2_ball"]
    assert (row.labels["label"], row.grasp_id) == ("ball", "mon/2_ball")


def test_a_moved_file_is_the_same_recording(paths, days):
    run(paths, days)
    correct(paths, "mon", "mon/2_ball", quality="reject", mass_g="12")
    before = rows(paths, "mon")["mon/2_ball"]
    (days / "mon" / "2_ball.wav").rename(days / "mon" / "2_bowl.wav")
    write_tone(days / "mon" / "2_ball.wav", 777)  # another recording under its old name
    result = run(paths, days)
    assert (result.added, result.unchanged, result.gone, result.conflicts) == (1, 4, [], [])
    assert result.differing[0] == "mon/2_ball: label 'ball' here, 'bowl' in the folder"
    assert set(rows(paths, "mon")) == {"mon/1_cube", "mon/2_ball", "mon/2_ball_2"}
    run(paths, days, on_change="labels")
    after = rows(paths, "mon")["mon/2_ball"]
    assert after.labels == {"label": "bowl", "n": "2", "mass_g": "12"}
    assert (after.sha256, after.quality) == (before.sha256, "reject")
    assert_all_in_tables(paths)
    assert run(paths, days).unchanged == 5


@pytest.mark.parametrize("copy", [True, False])
def test_what_is_gone_is_named_and_removed_on_demand(paths, days, copy):
    run(paths, days, copy=copy)
    (days / "mon" / "1_cube.wav").unlink()
    result = run(paths, days, copy=copy)
    assert (result.gone, len(rows(paths, "mon"))) == (["mon/1_cube"], 2)
    result = run(paths, days, copy=copy, on_change="prune")
    assert (result.gone, result.removed) == ([], 1)
    assert set(rows(paths, "mon")) == {"mon/2_ball"}
    if copy:
        assert_all_in_tables(paths)
    assert run(paths, days, copy=copy).gone == []
