"""Only what changed is computed, and what cannot be used is listed, never NaN."""

import json

import numpy as np
import pytest
import soundfile
from worlds import AUDIO, FEATURES, RATE_HZ, tone, write_tone

import ajgdata
from ajgdata.features.spectrum import spectrum
from ajgdata.store.audio import read_audio, write_pcm24
from ajgdata.store.publishing.table import table_of
from ajgdata.store.sessions import read_recordings
from ajgdata.types import Target

EDGE = Target(kind="regression", unit="mm", description="edge length")


def expected(project, name, session="s1"):
    audio = read_audio(project.folder(session) / "audio" / f"{name}.wav", AUDIO)
    return spectrum(audio.samples, RATE_HZ, FEATURES)


def test_values(project):
    rows = project.session()
    assert project.build() == (3, 0)
    store = project.store()
    assert store.columns["recording"].values.tolist() == ["s1/a", "s1/b", "s1/c"]
    assert store.columns["sha256"].values.tolist() == [r.sha256 for r in rows]
    assert store.columns["flags"].values.tolist() == ["", "", ""]
    np.testing.assert_array_equal(store.frequency_hz, np.arange(129) * RATE_HZ / 256)
    for row, (name, hz) in enumerate({"a": 500, "b": 750, "c": 1000}.items()):
        np.testing.assert_array_equal(store.feature[row], expected(project, name))
        assert store.frequency_hz[store.feature[row].argmax()] == hz
    assert project.quarantine() == []


def test_one_recording_more_is_one_computed(project):
    project.session()
    project.build()
    before = project.store()
    project.session("s1", {"a": 500.0, "aa": 600.0, "b": 750.0, "c": 1000.0})
    assert project.build() == (1, 3)
    store = project.store()
    assert store.columns["recording"].values.tolist() == ["s1/a", "s1/aa", "s1/b", "s1/c"]
    np.testing.assert_array_equal(store.feature[[0, 2, 3]], before.feature)
    np.testing.assert_array_equal(store.feature[1], expected(project, "aa"))


def test_a_damaged_file_is_computed_again(project):
    project.session()
    project.build()
    before = project.store()
    path = project.paths.features("d")
    content = bytearray(path.read_bytes())
    content[content.index(before.feature[1].tobytes())] ^= 1
    path.write_bytes(content)
    assert project.build() == (3, 0)
    np.testing.assert_array_equal(project.store().feature, before.feature)


def test_an_edited_recording_is_computed_again(project):
    rows = project.session()
    project.build()
    digest = write_tone(project.folder() / "audio" / "b.wav", 1500)
    assert project.build() == (0, 3)  # files of an unchanged session are not read
    project.write([rows[0].model_copy(update={"sample": 9}), *rows[1:]])
    assert project.build() == (0, 2)  # another sha256: quarantined
    assert [(f.recording_id, f.code) for f in project.quarantine()] == [("b", "changed")]
    project.write([r.model_copy(update={"sha256": ""}) for r in rows])
    assert project.build() == (1, 2)
    store = project.store()
    assert store.columns["sha256"].values[1] == digest
    np.testing.assert_array_equal(store.feature[1], expected(project, "b"))


def test_other_settings_or_code_compute_all(project):
    project.session()
    project.build()
    assert project.build(features=FEATURES.model_copy(update={"quantity": "power"})) == (3, 0)
    assert project.build(features=FEATURES.model_copy(update={"quantity": "power"})) == (0, 3)
    assert project.build() == (3, 0)
    assert project.build(code="2") == (3, 0)
    assert project.build(code="2", audio=AUDIO.model_copy(update={"microphone": "mean"})) == (3, 0)


def test_warnings_survive_reuse(project):
    rows = project.session()
    samples = 0.9 * np.sin(2 * np.pi * 200 * np.arange(2000) / RATE_HZ)
    samples[100:130] = 1
    write_pcm24(project.folder() / "audio" / "b.wav", samples, RATE_HZ)
    project.write([r.model_copy(update={"sha256": ""}) for r in rows])
    assert project.build() == (3, 0)
    findings = project.quarantine()
    assert sorted((f.recording_id, f.level, f.code) for f in findings) == [
        ("a", "warning", "no_sha256"),
        ("b", "warning", "clipped"),
        ("b", "warning", "no_sha256"),
        ("c", "warning", "no_sha256"),
    ]
    assert project.store().columns["flags"].values.tolist() == ["", "clipped", ""]
    assert project.build() == (0, 3)
    assert project.quarantine() == findings


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
    assert project.build() == (7, 0)
    findings = {f.recording_id: f for f in project.quarantine() if f.code != "no_sha256"}
    assert {name: f.code for name, f in findings.items()} == {
        "a": "empty",
        "b": "truncated",
        "c": "silent",
        "d": "other_rate",
        "e": "too_short",
        "f": "damaged",
        "g": "missing",
    }
    assert all(f.level == "error" and f.fix and f.session_id == "s1" for f in findings.values())
    store = project.store()
    assert store.columns["recording"].values.tolist() == ["s1/h"]
    assert np.isfinite(store.feature).all()
    assert project.build() == (6, 1)


def test_other_processes_write_the_same_bytes(project, monkeypatch):
    """Broken files, a spectrum beyond float32, a copy and reused rows have the same issues."""
    monkeypatch.setattr("ajgdata.pipeline.processes.ITEMS_PER_PROCESS", 40)
    pitches = {f"{number:03}": 400.0 + number for number in range(120)}
    first = project.session("s1", pitches)
    second = project.session("s2", {name: hz + 200.5 for name, hz in pitches.items()})
    audio = project.folder() / "audio"
    (audio / "003.wav").write_text("not audio")
    (audio / "050.wav").write_bytes((audio / "050.wav").read_bytes()[:1000])
    (audio / "119.wav").unlink()
    loud = tone(700).astype(np.float32) * np.float32(1e30)
    soundfile.write(audio / "070.wav", loud, RATE_HZ, subtype="FLOAT")
    (audio / "090.wav").write_bytes((audio / "080.wav").read_bytes())
    project.write([row.model_copy(update={"sha256": ""}) for row in first])
    raw = FEATURES.model_copy(update={"quantity": "power", "normalisation": "none"})
    files = [project.paths.features("d"), project.paths.quarantine("d")]
    files.append(project.paths.session_hashes("d"))

    def written(threads):
        for file in files:
            file.unlink(missing_ok=True)
        project.write(second, "s2")
        assert project.build("s1", "s2", features=raw, threads=threads) == (239, 0)
        contents = [file.read_bytes() for file in files]
        project.write([second[0].model_copy(update={"sample": 9}), *second[1:]], "s2")
        assert project.build("s1", "s2", features=raw, threads=threads) == (5, 234)
        return [*contents, *(file.read_bytes() for file in files)]

    assert written(threads=3) == written(threads=1)
    codes = {issue.recording_id: issue.code for issue in project.quarantine() if issue.leaves_out}
    broken = {"003": "damaged", "050": "truncated", "070": "no_feature", "119": "missing"}
    assert codes == {**broken, "080": "two_labels", "090": "two_labels"}


def built(project, *sessions, **options):
    project.build(*sessions, **options)
    return project.store(), project.quarantine()


@pytest.fixture
def two(project):
    project.session("s1")
    project.session("s2", {"a": 610.0, "d": 1210.0})
    return project


def test_values_and_names(two):
    two.declare(targets={"edge_mm": EDGE.model_dump(exclude_defaults=True)})
    store, quarantine = built(two, "s1", "s2", targets={"edge_mm": EDGE})
    columns = {name: c.values.tolist() for name, c in store.columns.items()}
    assert quarantine == []
    assert columns["recording"] == ["s1/a", "s1/b", "s1/c", "s2/a", "s2/d"]
    assert columns["grasp_id"] == ["s1/g_a", "s1/g_b", "s1/g_c", "s2/g_a", "s2/g_d"]
    assert columns["session_id"] == ["s1"] * 3 + ["s2"] * 2
    assert columns["sample"] == [0, 1, 2, 0, 1]
    assert columns["edge_mm"] == [500, 750, 1000, 610, 1210]
    assert store.columns["edge_mm"].attrs == {
        "units": "mm",
        "long_name": "edge length",
        "role": "target",
    }
    names = [("a", "s1"), ("b", "s1"), ("c", "s1"), ("a", "s2"), ("d", "s2")]
    spectra = [expected(two, *name) for name in names]
    np.testing.assert_array_equal(store.feature, spectra)
    assert store.attrs["source"] == "recorded"
    assert store.attrs["data_set"] == "d"
    assert json.loads(store.attrs["settings"])["features"]["window"] == 256
    with ajgdata.load_features("d", two.root) as features:
        chosen = features.sel(recording="s2/d")
        assert float(chosen["edge_mm"]) == 1210
        np.testing.assert_array_equal(chosen["feature"], spectra[4])


def test_a_column_that_one_session_lacks(two):
    rows = [
        r.model_copy(update={"labels": {"hardness": "3", "note": "ü", "kind": "?"}})
        for r in read_recordings(two.folder("s2"))[0]
    ]
    two.write(rows, "s2")
    kind = Target(kind="classification", missing=("?",))
    targets = {"edge_mm": EDGE, "hardness": Target(kind="regression"), "kind": kind}
    store, findings = built(two, "s1", "s2", targets=targets)
    assert findings == []
    np.testing.assert_array_equal(store.columns["edge_mm"].values, [500, 750, 1000] + [np.nan] * 2)
    np.testing.assert_array_equal(store.columns["hardness"].values, [np.nan] * 3 + [3, 3])
    assert store.columns["note"].values.tolist() == ["", "", "", "ü", "ü"]
    assert store.columns["kind"].values.tolist() == [""] * 5


def test_nothing_usable_at_all(project):
    project.session()
    (project.folder() / "session.yaml").unlink()
    store, findings = built(project, "s1")
    assert store.feature.shape == (0, 129)
    assert [f.code for f in findings] == ["bad_session"]
    with ajgdata.load_features("d", project.root) as features:
        assert features.sizes == {"recording": 0, "frequency": 129}


def test_a_changed_session_leaves_the_files_of_others_unread(two):
    assert two.build("s1", "s2") == (5, 0)
    (two.folder("s1") / "audio/a.wav").unlink()  # not noticed: its session did not change
    rows = read_recordings(two.folder("s2"))[0]
    two.write([rows[0].model_copy(update={"quality": "reject"}), rows[1]], "s2")
    assert two.build("s1", "s2") == (0, 4)
    assert [f.code for f in two.quarantine()] == ["rejected"]
    two.write(rows, "s2")
    assert two.build("s1", "s2") == (1, 4)
    assert two.store().columns["recording"].values.tolist()[3:] == ["s2/a", "s2/d"]
    assert two.quarantine() == []


def test_a_copy_is_used_when_its_original_is_gone(project):
    project.session("s1", {"a": 500.0})
    project.session("s2", {"a": 500.0, "b": 600.0})
    project.build("s1", "s2")
    assert [(f.session_id, f.recording_id, f.code) for f in project.quarantine()] == [
        ("s2", "a", "copy")
    ]
    assert project.build("s2") == (1, 1)
    assert project.store().columns["recording"].values.tolist() == ["s2/a", "s2/b"]
    assert project.quarantine() == []


def test_a_job_killed_between_its_files_vouches_for_none(project, monkeypatch):
    """The hashes of the old feature file never describe a new one."""
    project.session()
    project.build()

    def killed(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("ajgdata.pipeline.feature_file.write_findings", killed)
    with pytest.raises(KeyboardInterrupt):
        project.build()
    assert not project.paths.session_hashes("d").exists()
    monkeypatch.undo()
    assert project.build() == (3, 0)


def test_numbers_of_the_robot_are_coordinates_with_units(project):
    rows = project.session()
    numbers = {"a": "0.1", "b": "0.25", "c": ""}
    project.write(
        [
            row.model_copy(
                update={"labels": {**row.labels, "robot_x_m": numbers[row.recording_id]}}
            )
            for row in rows
        ]
    )
    project.build()
    column = project.store().columns["robot_x_m"]
    np.testing.assert_array_equal(column.values, [0.1, 0.25, np.nan])
    assert column.attrs == {"long_name": "measured by the robot's program", "units": "m"}
    published = table_of(project.store(), [".wav"] * 3, project.root)
    (described,) = [column for column in published.columns if column.name == "robot_x_m"]
    assert (described.data_type, described.unit) == ("number", "m")
    assert described.description == "measured by the robot's program"
    assert [row["robot_x_m"] for row in published.rows] == ["0.1", "0.25", ""]
