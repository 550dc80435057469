"""Importing again: what people corrected stays, what moved is followed, what is gone is said."""

import errno
import os
import shutil
from pathlib import Path

import pytest
from worlds import write_tone

from ajgdata.paths import Paths
from ajgdata.pipeline.importing import import_folder
from ajgdata.store import importing
from ajgdata.store.audio import file_sha256
from ajgdata.store.sessions import (
    list_sessions,
    read_recordings,
    read_session,
    write_recordings,
    write_session,
)
from ajgdata.types import Excitation, ImportSettings


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
    assert (result.relabelled, result.unchanged) == (0, 4)
    assert result.corrected == [
        "mon/2_ball: label 'bowl' here, 'ball' in the folder",
        "mon/2_ball: grasp_id 'g7' here, 'mon/2_ball' in the folder",
    ]
    row = rows(paths, "mon")["mon/2_ball"]
    assert (row.labels["label"], row.grasp_id) == ("bowl", "g7")
    result = run(paths, days, replace_labels=True)
    assert (result.relabelled, result.corrected) == (1, [])
    row = rows(paths, "mon")["mon/2_ball"]
    assert (row.labels["label"], row.grasp_id) == ("ball", "mon/2_ball")


def test_a_label_that_changed_in_the_folder_only_is_taken(paths, tmp_path):
    folder = tmp_path / "stones"
    write_tone(folder / "a.wav", 200)
    write_tone(folder / "b.wav", 300)
    table = ImportSettings(table="t.csv", file="{name}.wav")
    (folder / "t.csv").write_text("name,form\na,flat\nb,flat\n")
    run(paths, folder, settings=table, targets=["form"])
    correct(paths, "stones", "b", form="round")
    (folder / "t.csv").write_text("name,form\na,pointed\nb,sharp\n")
    result = run(paths, folder)
    assert result.corrected == ["b: form 'round' here, 'sharp' in the folder"]
    assert {n: r.labels["form"] for n, r in rows(paths, "stones").items()} == {
        "a": "pointed", "b": "round",
    }  # fmt: skip


def test_quality_comes_from_the_folder_and_stays_where_it_was_corrected(paths, tmp_path):
    folder = tmp_path / "stones"
    for number, name in enumerate("abc"):
        write_tone(folder / f"{name}.wav", 200 + 50 * number)
    (folder / "t.csv").write_text("name,form,quality\na,x,reject\nb,y,\nc,y,Clipped\n")
    run(paths, folder, settings=ImportSettings(table="t.csv", file="{name}.wav"), targets=["form"])
    qualities = {name: row.quality for name, row in rows(paths, "stones").items()}
    assert qualities == {"a": "reject", "b": "ok", "c": "clipped"}
    correct(paths, "stones", "a", quality="ok")
    correct(paths, "stones", "b", quality="reject")
    result = run(paths, folder)
    assert result.corrected == ["a: quality 'ok' here, 'reject' in the folder"]
    (folder / "t.csv").write_text("name,form,quality\na,x,reject\nb,y,\nc,y,reject\n")
    run(paths, folder)
    qualities = {name: row.quality for name, row in rows(paths, "stones").items()}
    assert qualities == {"a": "ok", "b": "reject", "c": "reject"}


def test_a_table_of_an_import_that_was_not_recorded_is_kept(paths, days):
    run(paths, days)
    for name in ("mon", "tue"):
        (paths.session("d", name) / "import.json").unlink()
    correct(paths, "tue", "tue/1_cube", label="mug")
    result = run(paths, days)
    assert result.corrected == ["tue/1_cube: label 'mug' here, 'cube' in the folder"]
    assert result.unchanged == 4


def test_a_moved_file_is_relabelled_not_copied(paths, days):
    run(paths, days)
    correct(paths, "mon", "mon/2_ball", quality="reject", mass_g="12")
    before = rows(paths, "mon")["mon/2_ball"]
    (days / "mon" / "2_ball.wav").rename(days / "mon" / "2_bowl.wav")
    result = run(paths, days)
    assert (result.added, result.relabelled, result.unchanged) == (0, 1, 3)
    assert (result.moved, result.gone) == ([("mon/2_ball", "mon/2_bowl")], [])
    held = rows(paths, "mon")
    assert set(held) == {"mon/1_cube", "mon/2_bowl"}
    after = held["mon/2_bowl"]
    assert after.labels == {"label": "bowl", "n": "2", "mass_g": "12"}
    assert (after.sha256, after.quality) == (before.sha256, "reject")
    assert_all_in_tables(paths)
    assert run(paths, days).unchanged == 4


def test_a_renamed_folder_takes_its_session_along(paths, days):
    run(paths, days)
    folder = paths.session("d", "tue")
    about = read_session(folder).model_copy(update={"gripper": "G7", "notes": "rain"})
    write_session(folder, about, read_recordings(folder)[0])
    (days / "tue").rename(days / "wed")
    result = run(paths, days)
    assert (result.added, result.relabelled, len(result.moved)) == (0, 2, 2)
    assert list_sessions(paths, "d") == ["mon", "wed"]
    session = read_session(paths.session("d", "wed"))
    assert (session.session_id, session.gripper, session.notes) == ("wed", "G7", "rain")
    assert_all_in_tables(paths)


@pytest.mark.parametrize("copy", [True, False])
def test_what_is_gone_is_named_and_removed_on_demand(paths, days, copy):
    run(paths, days, copy=copy)
    (days / "mon" / "1_cube.wav").unlink()
    for name in ("1_cube", "2_ball"):
        (days / "tue" / f"{name}.wav").unlink()
    result = run(paths, days, copy=copy)
    assert result.gone == ["mon/1_cube", "tue/1_cube", "tue/2_ball"]
    assert [len(rows(paths, name)) for name in ("mon", "tue")] == [2, 2]
    result = run(paths, days, copy=copy, prune=True)
    assert (result.gone, result.pruned) == ([], ["mon/1_cube", "tue/1_cube", "tue/2_ball"])
    assert list_sessions(paths, "d") == ["mon"]
    assert set(rows(paths, "mon")) == {"mon/2_ball"}
    if copy:
        assert_all_in_tables(paths)
    assert run(paths, days, copy=copy).gone == []


def test_nothing_is_pruned_that_may_be_there_yet(paths, days, monkeypatch):
    """A link whose target is not mounted, a folder closed to us, a moved file that is not read."""
    run(paths, days)
    cube, ball = days / "mon" / "1_cube.wav", days / "mon" / "2_ball.wav"
    cube.unlink()
    cube.symlink_to("/not/mounted/1_cube.wav")
    ball.rename(days / "mon" / "2_bowl.wav")

    def unread(path):
        if path.name == "2_bowl.wav":
            raise OSError(errno.EIO, "Input/output error")
        return read(path)

    read = importing.file_sha256
    monkeypatch.setattr(importing, "file_sha256", unread)
    result = run(paths, days, prune=True)
    assert (result.pruned, result.gone) == ([], ["mon/2_ball"])
    assert set(rows(paths, "mon")) == {"mon/1_cube", "mon/2_ball"}
    cube.unlink()
    write_tone(cube, 200)
    assert run(paths, days, prune=True).pruned == []  # one file could not be read
    monkeypatch.undo()
    result = run(paths, days, prune=True)
    assert (result.pruned, result.moved) == ([], [("mon/2_ball", "mon/2_bowl")])

    def closed(path):
        if path.parent.name == "tue":
            raise PermissionError(errno.EACCES, "Permission denied")
        return looked(path)

    looked = Path.lstat
    shutil.rmtree(days / "tue")
    monkeypatch.setattr(Path, "lstat", closed)
    result = run(paths, days, prune=True)
    assert (result.pruned, list_sessions(paths, "d")) == ([], ["mon", "tue"])


def test_a_name_taken_by_another_recording_prunes_neither(paths, days):
    run(paths, days)
    (days / "mon" / "2_ball.wav").replace(days / "mon" / "1_cube.wav")
    result = run(paths, days, prune=True)
    assert (result.conflicts, result.pruned) == (["mon/1_cube"], [])
    assert set(rows(paths, "mon")) == {"mon/1_cube", "mon/2_ball"}
    assert_all_in_tables(paths)


def test_a_renamed_folder_takes_the_played_sound_along(paths, days):
    """Which somebody put into the session: no folder has it."""
    run(paths, days)
    folder = paths.session("d", "tue")
    played = Excitation(
        file="excitation.wav",
        sha256=write_tone(folder / "excitation.wav", 120),
        description="sweep",
    )
    about = read_session(folder).model_copy(update={"excitation": played})
    write_session(folder, about, read_recordings(folder)[0])
    (days / "tue").rename(days / "wed")
    run(paths, days)
    folder = paths.session("d", "wed")
    assert read_session(folder).excitation == played
    assert file_sha256(folder / played.file) == played.sha256
    assert list_sessions(paths, "d") == ["mon", "wed"]


def test_the_same_folder_can_be_copied_and_referenced_in_sessions_of_its_own(paths, tmp_path):
    folder = tmp_path / "takes"
    write_tone(folder / "a.wav", 200)
    pattern = r"(?P<label>\w)\.wav"
    run(paths, folder, settings=ImportSettings(pattern=pattern, session="copied"))
    here = ImportSettings(pattern=pattern, session="left-there")
    assert run(paths, folder, settings=here, copy=False).added == 1
    assert list_sessions(paths, "d") == ["copied", "left-there"]
    assert read_session(paths.session("d", "copied")).audio_root is None


def test_recordings_of_another_folder_are_not_gone(paths, tmp_path):
    """Two folders may be brought into one session."""
    for name, hz in (("one/1_a", 200), ("two/2_b", 300)):
        write_tone(tmp_path / f"{name}.wav", hz)
    pattern = ImportSettings(pattern=r"(?P<n>\d)_(?P<label>\w)\.wav", session="s")
    run(paths, tmp_path / "one", settings=pattern)
    result = run(paths, tmp_path / "two", settings=pattern, prune=True)
    assert (result.added, result.gone, result.pruned) == (1, [], [])
    assert set(rows(paths, "s")) == {"1_a", "2_b"}


@pytest.mark.parametrize("copy", [True, False])
def test_the_rate_of_a_known_file_is_not_looked_at_again(paths, days, monkeypatch, copy):
    run(paths, days, copy=copy)
    inspected = []
    real = importing.inspect_audio
    monkeypatch.setattr(
        importing, "inspect_audio", lambda file: (inspected.append(file.name), real(file))[1]
    )
    assert run(paths, days, copy=copy).unchanged == 4
    write_tone(days / "tue/3_cone.wav", 700)
    result = run(paths, days, copy=copy)
    assert (result.added, result.unchanged, inspected) == (1, 4, ["3_cone.wav"])


def test_a_change_that_keeps_size_and_time_is_noticed(paths, days):
    run(paths, days)
    path = days / "mon/1_cube.wav"
    stat, content = path.stat(), bytearray(path.read_bytes())
    content[100] ^= 1
    path.write_bytes(content)
    os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns))
    assert run(paths, days).conflicts == ["mon/1_cube"]


def test_what_is_unreadable_is_said_each_time(paths, days):
    (days / "mon/3_cone.wav").write_bytes(b"RIFF, but no more")
    first = run(paths, days).unreadable
    assert [name for name, _ in first] == ["3_cone.wav"]
    assert run(paths, days).unreadable == first
