"""`ajgdata validate` says what the workflow would quarantine, and changes nothing."""

import os

import numpy as np
from worlds import RATE_HZ, write_tone

from ajgdata.pipeline.validate import validate_dataset
from ajgdata.store.audio import write_pcm24
from ajgdata.store.sessions import read_recordings, read_session, write_session


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


def test_an_edit_that_keeps_size_and_time_is_found(project):
    (row,) = project.session("s1", {"a": 500.0})
    path = project.folder() / row.file
    stat, content = path.stat(), bytearray(path.read_bytes())
    content[-1] ^= 1
    path.write_bytes(content)
    os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns))
    (found,) = check(project)[1]
    assert (found.recording_id, found.level) == ("a", "error")
    assert "sha256 differs" in found.problem
