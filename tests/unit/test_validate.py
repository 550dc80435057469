"""`ajgdata validate` says what the workflow would quarantine, and changes nothing."""

import os
import re
import socket

import numpy as np
import pytest
from worlds import RATE_HZ, tone, write_tone

from ajgdata.pipeline.validate import validate_dataset, validate_datasets, validate_folder
from ajgdata.store.audio import write_pcm24
from ajgdata.store.sessions import read_recordings, read_session, write_session
from ajgdata.types import DataError


def quiet(total):
    return lambda: None


def check(project):
    return validate_dataset(project.paths, "d", quiet)


def codes(findings):
    return [(f.session_id, f.recording_id, f.level, f.code) for f in findings]


def test_clean(project, snapshot):
    project.session("s1")
    project.session("s2", {"a": 610.0})
    before = snapshot(project.root)
    assert check(project) == (4, [])
    assert snapshot(project.root) == before


def test_every_kind_of_mistake_once(project):
    project.session("s0", {"a": 444.0})
    (project.folder("s0") / "session.yaml").unlink()
    rows = project.session("s1", {n: 500 + 10.0 * i for i, n in enumerate("abcdef")})
    audio = project.folder() / "audio"
    (audio / "a.wav").write_bytes((audio / "a.wav").read_bytes()[:500])
    write_pcm24(audio / "b.wav", np.zeros(2000), RATE_HZ)
    (audio / "c.wav").unlink()
    (audio / "e.wav").write_bytes((audio / "f.wav").read_bytes())
    rows = [r.model_copy(update={"sha256": ""}) for r in rows]
    rows[3] = rows[3].model_copy(update={"labels": {"edge_mm": "ten"}})
    project.write(rows)
    checked, findings = check(project)
    assert checked == 6
    assert codes(findings) == [
        ("s0", "*", "error", "bad_session"),
        ("s1", "a", "error", "truncated"),
        ("s1", "b", "error", "silent"),
        ("s1", "c", "error", "missing"),
        ("s1", "d", "warning", "bad_label"),
        ("s1", "e", "error", "two_labels"),
        ("s1", "f", "error", "two_labels"),
    ]
    assert all("\n" not in f.problem + f.fix and f.fix for f in findings)


def test_it_finds_what_the_workflow_finds(project):
    rows = project.session("s1", {n: 500 + 10.0 * i for i, n in enumerate("abcdef")})
    (project.folder() / "audio" / "a.wav").write_bytes(b"")
    write_tone(project.folder() / "audio" / "b.wav", 600, samples=100)
    rows[2] = rows[2].model_copy(update={"quality": "reject"})
    rows[3] = rows[3].model_copy(update={"labels": {"edge_mm": "ten"}})
    rows[:2] = [r.model_copy(update={"sha256": ""}) for r in rows[:2]]
    project.write(rows)
    project.shard()
    assert sorted(check(project)[1]) == sorted(project.merge("s1")[1])


def test_a_rejected_recording_is_no_mistake(project):
    rows = project.session("s1", {"a": 500.0, "b": 510.0})
    (project.folder() / "audio" / "a.wav").write_bytes(b"")
    rows[0] = rows[0].model_copy(update={"quality": "reject", "labels": {"edge_mm": "x"}})
    project.write(rows)
    assert codes(check(project)[1]) == [("s1", "a", "note", "rejected")]


def test_empty_files_are_not_called_copies_of_one_another(project):
    rows = project.session("s1", {"a": 500.0, "b": 510.0})
    for name in "ab":
        (project.folder() / "audio" / f"{name}.wav").write_bytes(b"")
    project.write([r.model_copy(update={"sha256": ""}) for r in rows])
    assert [f.code for f in check(project)[1]] == ["empty", "empty"]


def test_a_recording_that_came_late(project):
    sound = np.random.default_rng(0).uniform(-0.5, 0.5, 2000)
    rows = project.session("s1", dict.fromkeys("abcde", 500.0))
    for number, row in enumerate(rows):
        delay = 200 if number == 4 else 10 + number
        heard = np.concatenate([np.zeros(delay), sound, np.zeros(300 - delay)])
        write_pcm24(project.folder() / row.file, heard, RATE_HZ)
    rows = [r.model_copy(update={"sha256": ""}) for r in rows]
    project.write(rows, excitation=project.excitation("s1", sound))
    (found,) = check(project)[1]
    assert (found.recording_id, found.code) == ("e", "other_delay")
    assert "+23.5 ms" in found.problem  # (200 - 12) / 8 kHz
    project.write(rows, excitation=project.excitation("s1", np.zeros(2000)))
    assert codes(check(project)[1]) == [("s1", "*", "warning", "bad_excitation")]


def test_a_plain_folder(tmp_path):
    folder = tmp_path / "new recordings"
    for number in range(3):
        write_tone(folder / f"{number}.wav", 500 + number, samples=3000)
    write_pcm24(folder / "deep" / "3.wav", tone(600, 3000), 2 * RATE_HZ)
    (folder / "x.wav").mkdir()
    (folder / "4.wav").write_bytes((folder / "1.wav").read_bytes())
    (folder / "deep" / "5.wav").write_bytes((folder / "2.wav").read_bytes())
    (folder / "6.m4a").write_bytes(b"....ftypM4A ")
    (folder / "7.wav").write_bytes(b"")
    (folder / "8.wav").symlink_to(folder / "nowhere")
    (folder / "notes.txt").write_text("")
    checked, findings = validate_folder(folder, quiet)
    assert checked == 9
    said = " ".join(f"{f.problem} {f.fix}" for f in findings)
    assert not re.search(r"dataset\.yaml|declares|\brows?\b|features\.|audio\.", said)
    assert [(f.recording_id, f.level, f.code) for f in findings] == [
        ("2.wav", "error", "two_labels"),  # the folder says what a recording is
        ("4.wav", "warning", "copy"),
        ("6.m4a", "error", "damaged"),
        ("7.wav", "error", "empty"),
        ("8.wav", "error", "missing"),
        ("deep/3.wav", "error", "other_rate"),
        ("deep/5.wav", "error", "two_labels"),
    ]


def test_what_only_looks_like_a_file_is_named_and_never_opened(project, tmp_path):
    """Reading a named pipe would wait for ever; a link of git-annex may lead nowhere."""
    folder = tmp_path / "new"
    for name in "abcd":
        write_tone(folder / f"1_{name}.wav", 500 + ord(name), samples=3000)
    (folder / "1_b.wav").unlink()
    (folder / "1_b.wav").symlink_to("../.git/annex/objects/xx/SHA256E-s1.wav")
    (folder / "1_c.wav").unlink()
    os.mkfifo(folder / "1_c.wav")
    (folder / "1_d.wav").unlink()
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(os.path.relpath(folder / "1_d.wav"))
        checked, findings = validate_folder(folder, quiet)
    assert checked == 4
    assert [(f.recording_id, f.code) for f in findings] == [
        (f"1_{name}.wav", "missing") for name in "bcd"
    ]
    assert "git annex get" in findings[0].fix
    rows = project.session("s1", {"a": 500.0, "b": 510.0})
    (project.folder() / rows[0].file).unlink()
    os.mkfifo(project.folder() / rows[0].file)
    assert codes(check(project)[1]) == [("s1", "a", "error", "missing")]


def test_simulated_and_recorded_sessions_do_not_meet(project):
    project.session("s1")
    project.session("s2", {"x": 900.0})
    folder = project.folder("s2")
    session = read_session(folder).model_copy(update={"source": "virtual"})
    write_session(folder, session, read_recordings(folder)[0])
    checked, (found,) = check(project)
    assert (checked, found.level, found.code) == (4, "error", "mixed")
    assert found.problem.startswith("session s2 is simulated, session s1 is recorded")


def test_a_file_without_a_row_is_noted(project):
    project.session("s1")
    write_tone(project.folder() / "audio" / "deep" / "z.wav", 777)
    assert codes(check(project)[1]) == [("s1", "deep/z.wav", "note", "no_row")]


def test_names_are_data_sets_or_folders(project, tmp_path, monkeypatch):
    project.session()
    write_tone(tmp_path / "folder" / "a.wav", 500, samples=3000)

    def find():
        return project.paths

    assert validate_datasets(find, [], quiet) == (3, [])
    assert validate_datasets(find, ["d", str(tmp_path / "folder")], quiet) == (4, [])
    monkeypatch.chdir(project.paths.datasets)  # holds a folder named as the data set
    assert validate_datasets(find, ["d"], quiet) == (3, [])
    with pytest.raises(DataError, match="no such data set"):
        validate_datasets(find, ["other"], quiet)

    def nowhere():
        raise FileNotFoundError("no project")

    assert validate_datasets(nowhere, [str(tmp_path / "folder")], quiet) == (1, [])
