"""Shards: only what changed is computed, and what cannot be used is said, never NaN."""

import errno

import numpy as np
import xarray as xr
from worlds import AUDIO, FEATURES, RATE_HZ, tone, write_tone

from ajgdata.features.spectrum import spectrum
from ajgdata.store.audio import read_audio, write_pcm24


def expected(project, name, session="s1"):
    audio = read_audio(project.folder(session) / "audio" / f"{name}.wav", AUDIO)
    return spectrum(audio.samples, RATE_HZ, FEATURES)


def test_values(project):
    rows = project.session()
    assert project.shard() == (3, 0)
    shard = project.read_shard()
    assert shard.columns["recording"].values.tolist() == ["a", "b", "c"]
    assert shard.columns["sha256"].values.tolist() == [r.sha256 for r in rows]
    assert shard.columns["flags"].values.tolist() == ["", "", ""]
    np.testing.assert_array_equal(shard.frequency_hz, np.arange(129) * RATE_HZ / 256)
    for row, (name, hz) in enumerate({"a": 500, "b": 750, "c": 1000}.items()):
        np.testing.assert_array_equal(shard.feature[row], expected(project, name))
        assert shard.frequency_hz[shard.feature[row].argmax()] == hz
    assert project.shard_findings() == []


def test_one_recording_more_is_one_computed(project):
    project.session()
    project.shard()
    before = project.read_shard()
    project.session("s1", {"a": 500.0, "aa": 600.0, "b": 750.0, "c": 1000.0})
    assert project.shard() == (1, 3)
    shard = project.read_shard()
    assert shard.columns["recording"].values.tolist() == ["a", "aa", "b", "c"]
    np.testing.assert_array_equal(shard.feature[[0, 2, 3]], before.feature)
    np.testing.assert_array_equal(shard.feature[1], expected(project, "aa"))


def test_a_damaged_file_is_computed_again(project):
    project.session()
    project.shard()
    before, path = project.read_shard(), project.paths.shard("d", "s1")
    content = bytearray(path.read_bytes())
    content[content.index(before.feature[1].tobytes())] ^= 1
    path.write_bytes(content)
    assert project.shard() == (3, 0)
    np.testing.assert_array_equal(project.read_shard().feature, before.feature)


def test_a_file_that_may_not_be_read_is_computed_again(project, monkeypatch):
    project.session()
    project.shard()

    def forbidden(*_, **__):
        raise PermissionError(errno.EACCES, "Unable to open file (errno = 13)")

    with monkeypatch.context() as patch:
        patch.setattr(xr, "open_dataset", forbidden)
        assert project.shard() == (3, 0)
    np.testing.assert_array_equal(project.read_shard().feature[1], expected(project, "b"))


def test_an_edited_recording_is_computed_again(project):
    rows = project.session()
    project.shard()
    digest = write_tone(project.folder() / "audio" / "b.wav", 1500)
    assert project.shard() == (0, 2)  # another sha256: quarantined
    assert [(f.recording_id, f.code) for f in project.shard_findings()] == [("b", "changed")]
    project.write([r.model_copy(update={"sha256": ""}) for r in rows])
    assert project.shard() == (1, 2)
    shard = project.read_shard()
    assert shard.columns["sha256"].values[1] == digest
    np.testing.assert_array_equal(shard.feature[1], expected(project, "b"))


def test_other_settings_or_code_compute_all(project):
    project.session()
    project.shard()
    assert project.shard(features=FEATURES.model_copy(update={"quantity": "power"})) == (3, 0)
    assert project.shard(features=FEATURES.model_copy(update={"quantity": "power"})) == (0, 3)
    assert project.shard() == (3, 0)
    assert project.shard(code="2") == (3, 0)
    assert project.shard(code="2", audio=AUDIO.model_copy(update={"channel": "mean"})) == (3, 0)


def test_warnings_survive_reuse(project):
    rows = project.session()
    samples = 0.9 * np.sin(2 * np.pi * 200 * np.arange(2000) / RATE_HZ)
    samples[100:130] = 1
    write_pcm24(project.folder() / "audio" / "b.wav", samples, RATE_HZ)
    project.write([r.model_copy(update={"sha256": ""}) for r in rows])
    assert project.shard() == (3, 0)
    found = project.shard_findings()
    assert [(f.recording_id, f.level, f.code) for f in found] == [("b", "warning", "clipped")]
    assert project.read_shard().columns["flags"].values.tolist() == ["", "clipped", ""]
    assert project.shard() == (0, 3)
    assert project.shard_findings() == found


def test_broken_recordings_are_findings(project):
    tones = dict.fromkeys("abcdefgh", 500.0) | {n: 400 + 50.0 * i for i, n in enumerate("abcdefgh")}
    rows = project.session("s1", tones)
    audio = project.folder() / "audio"
    (audio / "a.wav").write_bytes(b"")
    (audio / "b.wav").write_bytes((audio / "b.wav").read_bytes()[:1000])
    write_pcm24(audio / "c.wav", np.zeros(2000), RATE_HZ)
    write_pcm24(audio / "d.wav", tone(500), 2 * RATE_HZ)
    write_tone(audio / "e.wav", 500, samples=255)
    (audio / "f.wav").write_text("not audio")
    (audio / "g.wav").unlink()
    project.write([r.model_copy(update={"sha256": ""}) for r in rows])
    assert project.shard() == (7, 0)
    told = {f.recording_id: f for f in project.shard_findings()}
    assert {name: f.code for name, f in told.items()} == {
        "a": "empty", "b": "truncated", "c": "silent", "d": "other_rate", "e": "too_short",
        "f": "damaged", "g": "missing",
    }  # fmt: skip
    assert all(f.level == "error" and f.fix and f.session_id == "s1" for f in told.values())
    shard = project.read_shard()
    assert shard.columns["recording"].values.tolist() == ["h"]
    assert np.isfinite(shard.feature).all()
    assert project.shard() == (6, 1)
