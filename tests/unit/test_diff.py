"""`ajgdata diff`: known changes of a data set are listed, and no others."""

import csv
import io
import json
import shutil

import pytest
from published import flip, reseal
from worlds import Project, assert_one_line

from ajgdata.paths import Paths
from ajgdata.pipeline.dataset_differences import ChangeKind, VersionDifference, compare_versions
from ajgdata.pipeline.dataset_versions import VersionRow, read_version
from ajgdata.pipeline.labelling import change_recording
from ajgdata.store.sessions import read_recordings, read_session, write_session


def row(sha256: str, **labels: str) -> VersionRow:
    return VersionRow(sha256, labels)


def test_each_kind_of_change_is_found_once():
    old = {
        "s/1": row("a", form="cube"),
        "s/2": row("b", form="cube"),
        "s/3": row("c", form="ball"),
        "s/4": row("d", form="ball"),
        "s/5": row("", form=""),
    }
    new = {
        "s/1": row("a", form="cube"),
        "s/2": row("b", form="ball"),
        "t/3": row("c", form="ball"),
        "s/5": row("e", form=""),
        "s/6": row("f", form="bar"),
    }
    result = compare_versions(old, new)
    assert result.differences == (
        VersionDifference(ChangeKind.ADDED, "s/6"),
        VersionDifference(ChangeKind.REMOVED, "s/4"),
        VersionDifference(ChangeKind.RENAMED, "t/3", "", "s/3", "t/3"),
        VersionDifference(ChangeKind.RELABELLED, "s/2", "form", "cube", "ball"),
    )
    assert list(result.counts().values()) == [1, 1, 1, 0, 1, 0, 0]
    assert compare_versions(old, old).differences == ()


def test_copies_are_not_renamed_and_a_new_column_is_one_difference():
    old = {"s/1": row("a", form="cube"), "s/2": row("a", form="cube")}
    new = {"s/3": row("a", form="cube", day="1"), "s/2": row("b", form="cube", day="1")}
    assert compare_versions(old, new).differences == (
        VersionDifference(ChangeKind.ADDED, "s/3"),
        VersionDifference(ChangeKind.REMOVED, "s/1"),
        VersionDifference(ChangeKind.SOUND, "s/2", "", "a", "b"),
        VersionDifference(ChangeKind.LABEL_ADDED, label="day"),
    )


@pytest.fixture
def changed(world, tmp_path) -> Project:
    """A copy of the project with one label, one name, one sound, and one quality changed."""
    shutil.copytree(world[0].root, tmp_path / "changed")
    project = Project(Paths(tmp_path / "changed"))
    folder = project.folder("s1")
    rows, _ = read_recordings(folder)
    by_name = {recording.recording_id: recording for recording in rows}
    first = by_name["take 0/ä"]
    by_name["take 0/ä"] = first.model_copy(
        update={"object": "07", "labels": {**first.labels, "edge_mm": "50.00"}}
    )
    by_name["take 1/ä"] = by_name["take 1/ä"].model_copy(update={"recording_id": "renamed"})
    by_name["take 2/2"] = by_name["take 2/2"].model_copy(update={"quality": "reject"})
    flip(folder / "audio/3.wav")  # its table has no sha256
    write_session(folder, read_session(folder), list(by_name.values()))
    return project


EXPECTED = {
    ("removed", "s1/take 2/2", ""),
    ("renamed", "s1/renamed", ""),
    ("sound", "s1/take 0/3", ""),
    ("relabelled", "s1/take 0/ä", "object"),
}


@pytest.mark.parametrize("old_is_published", [True, False])
def test_a_project_its_published_data_set_and_a_changed_copy(world, changed, old_is_published):
    project, folder = world[0], world[1].root
    old = str(folder) if old_is_published else f"{project.root}:d"
    assert compare_versions(read_version(str(folder)), read_version(old)).differences == ()
    result = compare_versions(read_version(old), read_version(f"{changed.root}:d"))
    found = {(item.change, item.recording, item.label) for item in result.differences}
    assert found == EXPECTED  # `50.00` is the number of before
    assert (result.n_old, result.n_new) == (12, 11)


def test_a_recording_that_is_accepted_after_the_run_is_in_the_version(changed):
    changed.build("s1", "s2")  # the quarantine has the rejection
    assert "s1/take 2/2" not in read_version(f"{changed.root}:d")
    change_recording(changed.paths, "d", "s1/take 2/2", "ok")
    assert "s1/take 2/2" in read_version(f"{changed.root}:d")


def test_the_command_prints_csv_or_json_and_its_exit_code_says_whether_they_differ(
    world, changed, ajgdata, monkeypatch
):
    folder = world[1].root
    monkeypatch.chdir(changed.root)
    code, out, err = ajgdata("diff", folder, "d")
    assert code == 3
    rows = list(csv.DictReader(io.StringIO(out)))
    assert rows[-1] == {
        "change": "relabelled",
        "recording": "s1/take 0/ä",
        "label": "object",
        "old": "00",
        "new": "07",
    }
    assert err.strip() == (
        f"12 recordings in {folder}, 11 in d: 0 added, 1 removed, 1 renamed, 1 sound, "
        "1 relabelled, 0 label added, 0 label removed"
    )
    code, out, err = ajgdata("diff", folder, "d", "--json")
    document = json.loads(out)
    assert (code, err, document["n_relabelled"], document["n_label_added"]) == (3, "", 1, 0)
    assert document["differences"][0] == {
        "change": "removed",
        "recording": "s1/take 2/2",
        "label": None,
        "old": None,
        "new": None,
    }
    assert ajgdata("diff", folder, folder)[:2] == (0, "")


def test_wrong_use_is_one_line(world, tree, ajgdata, tmp_path):
    table = tree / tree.METADATA
    table.write_text(table.read_text().replace("monday", "sunday", 1))
    cases = {
        tree.root: "its bytes are not those of SHA256SUMS",
        tmp_path / "nowhere": "is not a version of a data set. Use NAME",
        "unknown": "no such data set",
        "ftp://example.org/d": "addresses that begin with ftp:// are not supported",
    }
    for text, said in cases.items():
        code, out, err = ajgdata("diff", text, world[1].root)
        assert (code, out) == (1, "")
        assert_one_line(err, said)
    reseal(tree)
    assert ajgdata("diff", world[1].root, tree.root)[0] == 3
