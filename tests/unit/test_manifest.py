"""Manifests change when content changes, and only the one that is concerned."""

import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from worlds import tone, write_tone

from ajgdata.store import hashes, manifest
from ajgdata.store.hashes import HashCache
from ajgdata.store.manifest import read_manifest
from ajgdata.store.sessions import read_recordings


@pytest.fixture
def made(project):
    project.session("s1")
    project.session("s2", {"a": 600.0})
    assert project.refresh() == ["s1", "s2"]
    return project


def findings(project, session="s1"):
    return read_manifest(project.paths.audio_manifest("d", session))[1]


def test_content(made):
    content, found = read_manifest(made.paths.audio_manifest("d", "s1"))
    assert found == []
    assert [r["recording_id"] for r in content["recordings"]] == ["a", "b", "c"]
    for entry, row in zip(content["recordings"], read_recordings(made.folder())[0], strict=True):
        assert entry["sha256"] == row.sha256
        assert made.root / entry["path"] == made.folder() / row.file
    assert made.paths.label_manifest("d", "s2").read_text() == (
        "recording_id,grasp_id,sample,object,quality,source,gripper,medium,edge_mm\n"
        "a,g_a,0,box,ok,import,unknown,unknown,600.0\n"
    )


def test_touching_rewrites_nothing(made, snapshot):
    before = snapshot(made.paths.results)
    for path in made.folder().rglob("*.*"):
        path.touch()
    made.refresh()
    assert snapshot(made.paths.results) == before


def test_an_edited_recording_is_found_changed(made, snapshot):
    before = snapshot(made.paths.results / "manifest" / "d")
    write_tone(made.folder() / "audio" / "b.wav", 123)
    made.refresh()
    after = snapshot(made.paths.results / "manifest" / "d")
    assert {name for name in after if after[name] != before[name]} == {"s1.audio.json"}
    (found,) = findings(made)
    assert (found.recording_id, found.level, found.code) == ("b", "error", "changed")
    assert "ajgdata seal" in found.fix


def test_edits_that_keep_size_and_time_are_found(made):
    path = made.folder() / "audio" / "b.wav"
    stat = path.stat()
    write_bytes = bytearray(path.read_bytes())
    write_bytes[100] ^= 1
    path.write_bytes(write_bytes)
    os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns))
    assert (path.stat().st_size, path.stat().st_mtime_ns) == (stat.st_size, stat.st_mtime_ns)
    made.refresh()
    assert [f.code for f in findings(made)] == ["changed"]


def test_a_missing_recording(made):
    (made.folder() / "audio" / "a.wav").unlink()
    (made.folder() / "audio" / "b.wav").unlink()
    (made.folder() / "audio" / "b.wav").mkdir()
    made.refresh()
    assert [(f.recording_id, f.code) for f in findings(made)] == [
        ("a", "missing"),
        ("b", "missing"),
    ]


def test_relabelling_changes_the_label_manifest_only(made, snapshot):
    folder = made.paths.results / "manifest" / "d"
    before = snapshot(folder)
    rows = read_recordings(made.folder())[0]
    rows[1] = rows[1].model_copy(update={"labels": {"edge_mm": "9"}, "quality": "reject"})
    made.write(rows)
    made.refresh()
    after = snapshot(folder)
    assert {name for name in after if after[name] != before[name]} == {"s1.labels.csv"}
    assert b"b,g_b,1,box,reject,import,unknown,unknown,9\n" in after["s1.labels.csv"][0]


def test_a_new_row_and_a_removed_session(made, snapshot):
    folder = made.paths.results / "manifest" / "d"
    before = snapshot(folder)
    made.session("s1", {"a": 500.0, "b": 750.0, "c": 1000.0, "d": 1250.0})
    made.refresh()
    after = snapshot(folder)
    assert {n for n in after if after[n] != before[n]} == {"s1.audio.json", "s1.labels.csv"}
    names = [r["recording_id"] for r in json.loads(after["s1.audio.json"][0])["recordings"]]
    assert names == ["a", "b", "c", "d"]
    for path in sorted(made.folder("s2").rglob("*"), reverse=True):
        path.rmdir() if path.is_dir() else path.unlink()
    made.folder("s2").rmdir()
    assert made.refresh() == ["s1"]
    assert sorted(snapshot(folder)) == ["s1.audio.json", "s1.labels.csv"]


@pytest.mark.parametrize(
    ("file", "content", "said"),
    [
        ("session.yaml", b"source: [", "session.yaml: not valid YAML"),
        ("session.yaml", b"session_id: s1\nsource: import\nx: 1\n", "unknown key x"),
        ("recordings.csv", b"recording_id,file\n", "recordings.csv: column grasp_id is missing"),
        ("recordings.csv", b"\xff\xfe", "recordings.csv: not UTF-8"),
        ("session.yaml", None, "session.yaml: there is no such file"),
        ("recordings.csv", None, "recordings.csv: there is no such file"),
    ],
)
def test_a_broken_session_stops_no_other(made, snapshot, file, content, said):
    before = snapshot(made.paths.results / "manifest" / "d")
    path = made.folder() / file
    path.unlink() if content is None else path.write_bytes(content)
    assert made.refresh() == ["s1", "s2"]
    (found,) = findings(made)
    assert (found.recording_id, found.level, found.code) == ("*", "error", "bad_session")
    assert said in found.problem
    content = json.loads(made.paths.audio_manifest("d", "s1").read_bytes())
    assert content["recordings"] == []
    after = snapshot(made.paths.results / "manifest" / "d")
    assert {n for n in after if after[n] != before[n]} <= {"s1.audio.json", "s1.labels.csv"}


def test_a_file_outside_is_a_finding(made):
    rows = read_recordings(made.folder())[0]
    rows[0] = rows[0].model_copy(update={"file": "../s2/audio/a.wav"})
    made.write(rows)
    made.refresh()
    assert [(f.recording_id, f.code) for f in findings(made)] == [("a", "escapes")]


def test_the_played_sound_is_checked_too(project):
    rows = project.session("s1")
    played = project.excitation("s1", tone(300))
    project.write(rows, excitation=played)
    project.refresh()
    content, found = read_manifest(project.paths.audio_manifest("d", "s1"))
    assert found == []
    assert content["excitation"]["sha256"] == played.sha256
    for spoil in (
        lambda: project.excitation("s1", tone(301)),
        (project.folder() / "excitation.wav").unlink,
        lambda: project.write(rows, excitation=played.model_copy(update={"file": "../x.wav"})),
    ):
        spoil()
        project.refresh()
        content, found = read_manifest(project.paths.audio_manifest("d", "s1"))
        assert content["excitation"] is None
        assert [(f.level, f.code) for f in found] == [("warning", "bad_excitation")]
        assert len(content["recordings"]) == 3


def age(monkeypatch, seconds):
    """Let the clock of the cache run ahead of the files."""
    real = hashes.time.time_ns
    monkeypatch.setattr(hashes.time, "time_ns", lambda: real() + int(seconds * 1e9))


def test_hashes_are_remembered(tmp_path, monkeypatch):
    age(monkeypatch, 10)
    files = [tmp_path / name for name in "ab"]
    for path in files:
        path.write_bytes(path.name.encode())
    cache = HashCache(tmp_path / "cache")
    first = [cache.sha256(path) for path in files]
    cache.save()
    (kept,) = cache.folder.iterdir()
    known = json.loads(kept.read_bytes())
    assert sorted(known["files"]) == ["a", "b"]
    # a wrong hash put into the cache comes back: the file is not read again
    known["files"]["a"][4] = "remembered"
    kept.write_text(json.dumps(known))
    before = kept.stat().st_ino
    again = HashCache(cache.folder)
    assert [again.sha256(path) for path in files] == ["remembered", first[1]]
    again.save()
    assert kept.stat().st_ino == before
    assert HashCache(cache.folder, forget=True).sha256(files[0]) == first[0]
    stat = files[0].stat()
    files[0].write_bytes(b"A")
    os.utime(files[0], ns=(stat.st_atime_ns, stat.st_mtime_ns))
    monkeypatch.undo()
    fresh = HashCache(cache.folder)
    ctime_differs = files[0].stat().st_ctime_ns != stat.st_ctime_ns
    assert (fresh.sha256(files[0]) != "remembered") == ctime_differs


def test_a_file_that_may_yet_change_within_the_clocks_tick_is_not_remembered(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(b"1")
    cache = HashCache(tmp_path / "cache")
    one = cache.sha256(path)
    stat = path.stat()
    path.write_bytes(b"2")
    os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns))
    assert cache.sha256(path) != one
    cache.save()
    assert not cache.folder.exists()


def test_hashes_of_what_is_gone_are_forgotten_once_something_changes(tmp_path, monkeypatch):
    """Those of a folder that is not there after a month, as it may be on a disk that is away."""
    age(monkeypatch, 10)
    held = [tmp_path / name for name in ("one/a", "one/b", "two/c")]
    cache = HashCache(tmp_path / "cache")
    for path in held:
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(b"x")
        cache.sha256(path)
    cache.save()
    held[0].unlink()
    shutil.rmtree(held[2].parent)

    def kept():
        files = [json.loads(one.read_bytes()) for one in cache.folder.iterdir()]
        return {Path(one["folder"]).name: sorted(one["files"]) for one in files}

    cache.save()
    assert kept() == {"one": ["a", "b"], "two": ["c"]}
    for days, known in ((10, {"one": ["b", "d"], "two": ["c"]}), (40, {"one": ["b", "d", "e"]})):
        age(monkeypatch, days * 86_400)
        new = tmp_path / "one" / ("d" if days == 10 else "e")
        new.write_bytes(b"new")
        cache.sha256(new)
        cache.save()
        assert kept() == known


@pytest.mark.parametrize(
    "content", [b"{", b"[1]", b"\xff", b'{"files": 3}', b'{"files": {"a": 3, "b": [1]}}']
)
def test_a_spoilt_cache_is_forgotten(tmp_path, monkeypatch, content):
    age(monkeypatch, 10)
    path = tmp_path / "a"
    path.write_bytes(b"1")
    cache = HashCache(tmp_path / "cache")
    right = cache.sha256(path)
    cache.save()
    (kept,) = cache.folder.iterdir()
    kept.write_bytes(content)
    assert HashCache(cache.folder).sha256(path) == right


def surveyed(monkeypatch):
    """Names of the sessions that are read from now on."""
    read = []

    def survey(paths, dataset, name, cache):
        read.append(name)
        return real(paths, dataset, name, cache)

    real = manifest.survey
    monkeypatch.setattr(manifest, "survey", survey)
    return read


@pytest.mark.parametrize("gone", [False, True])
def test_only_sessions_of_which_something_changed_are_read_again(made, monkeypatch, gone):
    age(monkeypatch, 10)
    read = surveyed(monkeypatch)
    made.refresh()
    made.refresh()
    assert read == ["s1", "s2"]
    manifests = made.paths.audio_manifest("d", "s2")
    path, before = made.folder("s2") / "audio" / "a.wav", manifests.read_bytes()
    path.unlink() if gone else write_tone(path, 123)
    del read[:]
    assert list(manifest.outdated(made.paths, "d")) == [manifests]
    made.refresh()
    assert read == ["s2", "s2"]
    assert manifests.read_bytes() != before
    made.refresh()  # what is wrong may be mended elsewhere: read again
    assert read == ["s2", "s2", "s2"]


@pytest.mark.parametrize("file", ["s1.audio.json", "s1.labels.csv"])
def test_a_manifest_that_somebody_changed_is_made_again(made, monkeypatch, file):
    age(monkeypatch, 10)
    made.refresh()
    path = made.paths.results / "manifest" / "d" / file
    right = path.read_bytes()
    for spoilt in (b"", b"{}", right.replace(b"b", b"x", 1)):
        path.write_bytes(spoilt)
        made.refresh()
        assert path.read_bytes() == right


def test_a_corrected_label_and_a_new_declaration_are_seen(made, monkeypatch):
    age(monkeypatch, 10)
    made.refresh()
    for file, old, new in (
        ("recordings.csv", b"750.0", b"751.0"),
        ("session.yaml", b"medium: unknown", b"medium: sugar"),
    ):
        path = made.folder() / file
        path.write_bytes(path.read_bytes().replace(old, new))
        made.refresh()
        labels = made.paths.label_manifest("d", "s1").read_bytes()
        assert new.split()[-1] in labels


def test_row_order_does_not_matter(made):
    before = made.paths.audio_manifest("d", "s1").read_bytes()
    labels = made.paths.label_manifest("d", "s1").read_bytes()
    path = made.folder() / "recordings.csv"
    header, *rows = path.read_text().splitlines()
    path.write_text("\n".join([header, *np.random.default_rng(0).permutation(rows)]) + "\n")
    made.refresh()
    assert made.paths.audio_manifest("d", "s1").read_bytes() == before
    assert made.paths.label_manifest("d", "s1").read_bytes() == labels


def test_the_project_may_move(made, tmp_path):
    before = made.paths.audio_manifest("d", "s1").read_bytes()
    made.root.rename(tmp_path / "moved")
    moved = type(made.paths)(tmp_path / "moved")
    manifest.refresh(moved, "d")
    assert moved.audio_manifest("d", "s1").read_bytes() == before
