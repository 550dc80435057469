"""Segments of long files: import, features, checks and publishing, with known samples and counts.

Each long file has one tap per second; the pitch of a tap is its class.
"""

import json
import math
from pathlib import Path

import numpy as np
import pytest
import soundfile as sf
import yaml
from recorded import make_features

import ajgdata as library
from ajgdata.features.spectrum import spectrum
from ajgdata.pipeline import feature_file
from ajgdata.pipeline.fetch import fetch
from ajgdata.pipeline.publish import publish
from ajgdata.store import audio
from ajgdata.store.features import read_store
from ajgdata.store.file_segments import cut_by_period, read_label_track
from ajgdata.store.findings import read_findings
from ajgdata.store.sessions import read_dataset, read_recordings, write_recordings
from ajgdata.types import DataError, Recording, Segment, SegmentSettings

NAME = "fingers"
RATE_HZ = 8_000
SECONDS = 20
#: Class of the tap of each second: four intervals of five taps.
CLASSES = [name for name in ("none", "tip", "none", "base") for _ in range(5)]
PITCH_HZ = {"none": 800, "tip": 1500, "base": 2400}


def taps(seed: int, pitches_hz: list[float] | None = None) -> np.ndarray:
    """Return a long recording (frames,) with one tap per second in noise."""
    pitches_hz = pitches_hz or [PITCH_HZ[name] for name in CLASSES]
    rng = np.random.default_rng(seed)
    samples = rng.normal(0, 0.01, len(pitches_hz) * RATE_HZ)
    time_s = np.arange(RATE_HZ // 2) / RATE_HZ
    for second, pitch_hz in enumerate(pitches_hz):
        hz = pitch_hz * (1 + 0.002 * rng.normal())
        first = second * RATE_HZ + 400
        samples[first : first + len(time_s)] += (
            0.4 * np.exp(-5 * time_s) * np.sin(2 * np.pi * hz * time_s)
        )
    return samples


def track(length_s: int = 1) -> str:
    """Return a label track as Audacity writes it, with intervals of `length_s`."""
    lines = [
        f"{start:.6f}\t{start + length_s:.6f}\t{CLASSES[start]}\n"
        for start in range(0, SECONDS, length_s)
    ]
    return "\\\t200.000000\t3000.000000\n".join(lines)


@pytest.fixture
def recorded(project) -> Path:
    """Two long files with label tracks, and the played sound."""
    folder = project.root / "board"
    folder.mkdir()
    for number in (1, 2):
        sf.write(folder / f"{number}.wav", taps(number), RATE_HZ, subtype="PCM_16")
        (folder / f"{number}.txt").write_text(track())
    sf.write(folder / "0_tap.wav", taps(0)[:RATE_HZ], RATE_HZ, subtype="PCM_16")
    return folder


@pytest.fixture
def imported(recorded, ajgdata, project) -> Path:
    """The session of both files, imported by their label tracks."""
    ajgdata("import", recorded, "--dataset", NAME, "--segments", "track")
    return project.paths.session(NAME, "board")


def edit(session: Path, name: str, **cells: object) -> None:
    """Change cells of a recording."""
    rows = [
        row.model_copy(update=cells) if row.recording_id == name else row
        for row in read_recordings(session)[0]
    ]
    write_recordings(session, rows)


def issues(ajgdata) -> list[tuple[str, str, str]]:
    """Return level, recording and code of the issues that `ajgdata check` prints."""
    _, out, _ = ajgdata("check", NAME, "--json")
    return [
        (issue["level"], issue["recording_id"], issue["code"])
        for issue in json.loads(out)["issues"]
        if issue["code"] != "placement"
    ]


def test_a_label_track_gives_each_interval_its_label_and_its_samples(imported, recorded):
    rows, findings = read_recordings(imported)
    assert findings == []
    assert len(rows) == 2 * SECONDS
    assert [row.labels["label"] for row in rows] == CLASSES * 2
    assert rows[7].recording_id == "1_08"
    assert (rows[7].file, rows[7].start_s, rows[7].end_s) == ("audio/1.wav", 7.0, 8.0)
    settings = library.types.AudioSettings(sample_rate_hz=RATE_HZ)
    seventh = audio.read_audio(imported / rows[7].file, settings, rows[7].segment)
    whole = sf.read(recorded / "1.wav", dtype="float32")[0]
    np.testing.assert_array_equal(seventh.samples, whole[7 * RATE_HZ : 8 * RATE_HZ])
    # one copy of each file, unchanged, and the played sound is no recording
    assert sorted(path.name for path in (imported / "audio").iterdir()) == ["1.wav", "2.wav"]
    assert (imported / "audio/1.wav").read_bytes() == (recorded / "1.wav").read_bytes()
    assert (imported / "excitation.wav").is_file()


def test_successive_segments_with_one_label_are_one_grasp(imported):
    rows = read_recordings(imported)[0]
    assert [row.grasp_id for row in rows[:SECONDS]] == [f"1_{1 + i // 5}" for i in range(SECONDS)]
    assert [row.sample for row in rows[:SECONDS]] == [0, 1, 2, 3, 4] * 4


def test_the_console_states_segments_and_grasps(recorded, ajgdata):
    code, out, _ = ajgdata("import", recorded, "--dataset", NAME, "--segments", "track")
    assert code == 0
    assert "40 segments of 2 files: 8 grasps: successive segments of a file" in out


def test_a_second_import_changes_nothing(imported, recorded, ajgdata, snapshot):
    before = snapshot(imported)
    code, out, _ = ajgdata("import", recorded, "--dataset", NAME)
    assert (code, out.splitlines()[0]) == (
        0,
        f"0 added, 0 changed, 40 unchanged in 1 session(s) of {NAME}",
    )
    assert snapshot(imported) == before


def test_a_corrected_track_is_kept_or_taken(imported, recorded, ajgdata):
    text = track().replace("7.000000\t8.000000", "7.000000\t7.900000")
    (recorded / "1.txt").write_text(text)
    code, out, _ = ajgdata("import", recorded, "--dataset", NAME)
    assert code == 3
    assert "kept 1_08: has other times in the folder" in out
    assert read_recordings(imported)[0][7].end_s == 8.0
    code, out, _ = ajgdata("import", recorded, "--dataset", NAME, "--on-change", "files")
    assert (code, out.split(" in ")[0]) == (0, "0 added, 1 changed, 39 unchanged")
    assert read_recordings(imported)[0][7].end_s == 7.9


def test_pruned_segments_leave_the_file_of_the_others(imported, recorded, ajgdata):
    (recorded / "1.txt").write_text("".join(track().splitlines(keepends=True)[:1]))
    ajgdata("import", recorded, "--dataset", NAME, "--on-change", "prune")
    rows = read_recordings(imported)[0]
    assert len(rows) == 1 + SECONDS
    assert (imported / rows[0].file).is_file()


def test_a_period_divides_intervals_and_points_begin_segments(recorded, ajgdata, project):
    (recorded / "1.txt").write_text(track(5))
    (recorded / "2.txt").write_text("3.25\t3.25\tnone\n11\t11\tbase\n")
    settings = ("--segments", "track", "--period", "1", "--offset", "0.05")
    ajgdata("import", recorded, "--dataset", NAME, *settings)
    rows = read_recordings(project.paths.session(NAME, "board"))[0]
    first = [row for row in rows if row.file == "audio/1.wav"]
    # four whole periods fit into each interval of five seconds
    starts = [5 * interval + 0.05 + period for interval in range(4) for period in range(4)]
    assert [row.start_s for row in first] == pytest.approx(starts, abs=1e-9)
    assert [row.labels["label"] for row in first] == [CLASSES[math.floor(s)] for s in starts]
    second = [(row.start_s, row.end_s) for row in rows if row.file == "audio/2.wav"]
    assert second == [(3.3, 4.3), (11.05, 12.05)]


def test_a_file_without_labels_is_one_grasp(recorded, ajgdata, project):
    for path in recorded.glob("*.txt"):
        path.unlink()
    code, out, _ = ajgdata("import", recorded, "--dataset", NAME, "--period", "1")
    assert code == 0
    assert "40 segments of 2 files: 2 grasps" in out
    rows = read_recordings(project.paths.session(NAME, "board"))[0]
    assert len(rows) == 2 * SECONDS
    assert {row.grasp_id for row in rows} == {"1_1", "2_1"}
    assert rows[SECONDS - 1].end_s == SECONDS


def test_names_of_the_starter_kit_label_all_periods_of_a_file(recorded, ajgdata, project):
    (recorded / "1.wav").rename(recorded / "17_7.5.wav")
    (recorded / "2.wav").unlink()
    settings = ("--pattern", "starter-kit", "--period", "1")
    ajgdata("import", recorded, "--dataset", NAME, *settings)
    rows = read_recordings(project.paths.session(NAME, "board"))[0]
    assert {(row.labels["label"], row.grasp_id) for row in rows} == {("7.5", "17_7.5_1")}
    assert len(rows) == SECONDS


def test_a_table_of_segments_can_name_grasps(recorded, ajgdata, project):
    lines = ["name,start,end,label,grasp_id", "1,0,1.5,none,a", "1,1.5,,tip,a", "2,,,tip,b"]
    (recorded / "labels.csv").write_text("\n".join(lines))
    settings = ("--segments", "table", "--table", "labels.csv", "--file", "{name}.wav")
    code, _, _ = ajgdata("import", recorded, "--dataset", NAME, *settings, "--target", "label")
    assert code == 3  # a grasp with two labels
    rows = read_recordings(project.paths.session(NAME, "board"))[0]
    assert [(row.recording_id, row.segment, row.grasp_id) for row in rows] == [
        ("1_1", Segment(0, 1.5), "a"),
        ("1_2", Segment(1.5), "a"),
        ("2", Segment(), "b"),
    ]


WRONG_TRACKS = {
    "0 1 tip": "line 1: '0 1 tip' is not start, end and label with tabs between them",
    "0\t1\ta\n1,5\t2\tb": "line 2: '1,5' is not a time",
    "-1\t1\ta": "line 1: -1 s is before the file",
    "2\t1\ta": "line 1: the label ends before it begins",
    "0\t1\ta\n0\t1\tb": "line 2: has the same times as line 1",
    "3\t3\ta": "the label at 3 s is a point",
    "\\\t1\t2\n": "has no labels",
}


@pytest.mark.parametrize("text", WRONG_TRACKS)
def test_a_wrong_label_track_is_one_line(recorded, ajgdata, project, text):
    (recorded / "1.txt").write_text(text)
    code, _, error = ajgdata("import", recorded, "--dataset", NAME, "--segments", "track")
    assert code == 1
    assert len(error.splitlines()) == 1
    expected = WRONG_TRACKS[text]
    if expected.startswith("line"):
        number, _, problem = expected.removeprefix("line ").partition(": ")
        assert f"1.txt:{number}: {problem}" in error
    else:
        assert expected in error
    assert not project.paths.session(NAME, "board").exists()


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        (["--offset", "1"], "give labels (--segments) or period_s (--period)"),
        (["--segments", "track", "--offset", "1"], "offset_s (--offset) needs period_s"),
        (["--segments", "table"], "segments of a table (--segments table) need table"),
        (["--period", "0"], "greater than 0"),
        (["--segments", "track", "--pattern", r"(?P<label>\d)\.wav"], "`label` is in the label"),
    ],
)
def test_wrong_options_are_one_line(recorded, ajgdata, options, problem):
    code, _, error = ajgdata("import", recorded, "--dataset", NAME, *options)
    assert code == 1
    assert len(error.splitlines()) == 1
    assert problem in error


def test_a_table_without_times_is_one_line(recorded, ajgdata):
    (recorded / "labels.csv").write_text("name,start,label\n1,0,tip\n")
    settings = ("--segments", "table", "--table", "labels.csv", "--file", "{name}.wav")
    code, _, error = ajgdata("import", recorded, "--dataset", NAME, *settings)
    assert code == 1
    assert "labels.csv:2: has no columns end or end_s" in error


def test_files_that_give_no_segment_are_listed(recorded, ajgdata):
    (recorded / "1.txt").unlink()
    code, out, _ = ajgdata("import", recorded, "--dataset", NAME, "--segments", "track")
    assert code == 3
    assert "failed 1.wav: has no label track 1.txt next to it" in out
    code, _, error = ajgdata("import", recorded, "--dataset", "other", "--period", "30")
    assert code == 1
    assert "is shorter than --offset and --period" in error


def test_check_lists_segments_that_cannot_be_right(imported, ajgdata):
    assert issues(ajgdata) == []
    edit(imported, "1_20", end_s=20.5)
    edit(imported, "1_06", start_s=4.5)
    edit(imported, "1_12", start_s=10.5)
    assert sorted(issues(ajgdata)) == [
        ("error", "1_20", "beyond_end"),
        ("note", "1_12", "overlap"),
        ("warning", "1_06", "overlap"),
    ]
    _, out, _ = ajgdata("check", NAME)
    assert "the segment 19 to 20.5 s is not within the file, which has 20 s" in out
    assert "its segment 4.5 to 6 s overlaps 4 to 5 s of 1_05" in out
    # a long segment overlaps each segment in it
    edit(imported, "2_01", end_s=2.5)
    overlaps = [name for _, name, code in issues(ajgdata) if code == "overlap"]
    assert overlaps == ["1_06", "1_12", "2_02", "2_03"]


@pytest.mark.parametrize(
    ("start_s", "end_s", "problem"),
    [("-1", "2", "start_s"), ("3", "3", "is empty"), ("3", "2", "is empty"), ("x", "2", "start_s")],
)
def test_a_wrong_time_in_the_table_is_a_bad_row(imported, ajgdata, start_s, end_s, problem):
    table = imported / "recordings.csv"
    table.write_text(table.read_text().replace(",7.0,8.0,", f",{start_s},{end_s},", 1))
    (finding,) = read_recordings(imported)[1]
    assert (finding.code, finding.level) == ("bad_row", "error")
    assert problem in finding.problem


def test_equal_segments_are_copies_and_other_segments_of_a_file_are_not(imported, ajgdata):
    edit(imported, "1_03", start_s=1.0, end_s=2.0)
    codes = [(name, code) for _, name, code in issues(ajgdata)]
    assert codes == [("1_03", "copy")]


def test_features_are_those_of_the_samples_and_only_new_segments_are_computed(
    imported, recorded, project, monkeypatch
):
    assert make_features(project.paths, NAME) == (2 * SECONDS, 0)
    store = read_store(project.paths.features(NAME))
    whole = sf.read(recorded / "2.wav", dtype="float32")[0]
    spec = read_dataset(project.paths, NAME)
    for second in (0, 7, 19):
        row = store.columns["recording"].values.tolist().index(f"board/2_{second + 1:02}")
        part = whole[second * RATE_HZ : (second + 1) * RATE_HZ]
        expected = spectrum(part, RATE_HZ, spec.features)
        np.testing.assert_array_equal(store.feature[row], expected)
        assert store.columns["start_s"].values[row] == second
    assert store.columns["start_s"].attrs["units"] == "s"
    edit(imported, "1_08", end_s=7.5)
    assert make_features(project.paths, NAME) == (1, 2 * SECONDS - 1)
    assert make_features(project.paths, NAME) == (0, 2 * SECONDS)
    assert read_findings(project.paths.quarantine(NAME)) == []


def test_each_file_is_hashed_once(imported, project, monkeypatch):
    hashed = []
    file_sha256 = audio.file_sha256

    def count(path: Path) -> str:
        hashed.append(path.name)
        return file_sha256(path)

    monkeypatch.setattr(audio, "file_sha256", count)
    make_features(project.paths, NAME)
    assert hashed == ["1.wav", "2.wav"]
    assert feature_file.check_session(imported).findings == []


def test_a_changed_file_quarantines_its_segments(imported, project):
    sf.write(imported / "audio/1.wav", taps(9), RATE_HZ, subtype="PCM_16")
    assert make_features(project.paths, NAME) == (SECONDS, 0)
    findings = read_findings(project.paths.quarantine(NAME))
    assert {finding.code for finding in findings} == {"changed"}
    assert len(findings) == SECONDS


def test_loaded_waveforms_are_the_segments(imported, recorded, monkeypatch, project):
    monkeypatch.chdir(project.root)
    recordings = library.load_recordings(NAME)
    assert recordings.waveform.shape == (2 * SECONDS, RATE_HZ)
    whole = sf.read(recorded / "1.wav", dtype="float32")[0]
    np.testing.assert_array_equal(recordings.waveform[7].values, whole[7 * RATE_HZ : 8 * RATE_HZ])
    assert recordings.end_s.values[7] == 8.0


@pytest.mark.parametrize(("is_class", "by_grasp"), [(True, (0.95, 1)), (False, (0, 0.3))])
def test_folds_separate_grasps_so_that_a_score_is_of_the_class(
    project, ajgdata, is_class, by_grasp
):
    """The pitch is that of the class; or each grasp has its own pitch, and both grasps with the
    next pitches have the other class. Only folds of single segments then predict the class, and
    folds of grasps are worse than chance (50 %)."""
    folder = project.root / "board"
    folder.mkdir()
    for number in range(6):
        names = [("none", "tip")[second // 5 % 2] for second in range(SECONDS)]
        pitches = [PITCH_HZ[name] for name in names]
        if not is_class:
            pitches = [500 + 250 * number + 60 * (second // 5) for second in range(SECONDS)]
        sf.write(folder / f"{number + 1}.wav", taps(number, pitches), RATE_HZ, subtype="PCM_24")
        lines = [f"{second}\t{second + 1}\t{name}" for second, name in enumerate(names)]
        (folder / f"{number + 1}.txt").write_text("\n".join(lines))
    ajgdata("import", folder, "--dataset", NAME, "--segments", "track")
    assert make_features(project.paths, NAME) == (6 * SECONDS, 0)
    store = read_store(project.paths.features(NAME))
    grasps = store.columns["grasp_id"].values
    assert len(set(grasps)) == 24
    segments = store.columns["recording"].values
    for groups, (lowest, highest) in ((grasps, by_grasp), (segments, (0.95, 1))):
        result = library.cross_validate(
            store.feature,
            store.columns["label"].values,
            groups,
            kind="classification",
            model="knn",
        )
        assert lowest <= library.estimate_score(result, groups).value <= highest


def test_published_segments_are_files_with_the_same_samples(
    imported, recorded, project, tmp_path, monkeypatch
):
    make_features(project.paths, NAME)
    out = tmp_path / "tree"
    written = []

    def counted(path, segment):
        written.append((path, segment))
        return audio.segment_bytes(path, segment)

    monkeypatch.setattr("ajgdata.pipeline.publish.segment_bytes", counted)
    assert publish(project.paths, NAME, out).recordings == 2 * SECONDS
    assert len(written) == len(set(written)) == 2 * SECONDS
    published = read_store(out / "features.nc")
    stored = read_store(project.paths.features(NAME))
    names = published.columns["recording"].values.tolist()
    for name, digest in zip(names, published.columns["sha256"].values, strict=True):
        assert digest == audio.file_sha256(out / "audio" / f"{name}.wav")
    np.testing.assert_array_equal(published.feature, stored.feature)
    assert published.attrs == stored.attrs
    assert set(stored.columns) == set(published.columns)
    whole = sf.read(recorded / "1.wav", dtype="int16")[0]
    got, rate = sf.read(out / "audio/board/1_08.wav", dtype="int16")
    assert rate == RATE_HZ
    np.testing.assert_array_equal(got, whole[7 * RATE_HZ : 8 * RATE_HZ])
    fetch(project.paths, str(out), name="again")
    fetched = read_recordings(project.paths.session("again", "board"))[0]
    assert {row.segment for row in fetched} == {Segment()}
    make_features(project.paths, "again")
    np.testing.assert_array_equal(
        read_store(project.paths.features("again")).feature,
        read_store(project.paths.features(NAME)).feature,
    )


@pytest.mark.parametrize("kind", ["PCM_U8", "PCM_16", "PCM_24", "PCM_32", "FLOAT", "VORBIS"])
def test_a_published_segment_keeps_samples_of_each_encoding(tmp_path, kind):
    container = "OGG" if kind == "VORBIS" else "WAV"
    path = tmp_path / "long"
    stereo = np.stack([taps(1), 1.5 * taps(2)], axis=1)
    sf.write(path, np.clip(stereo, -0.99, 0.99), RATE_HZ, format=container, subtype=kind)
    content = audio.segment_bytes(path, Segment(2.5, 3.25))
    assert content == audio.segment_bytes(path, Segment(2.5, 3.25))
    part = tmp_path / "part.wav"
    part.write_bytes(content)
    expected = sf.read(path, dtype="float64")[0][20_000:26_000]
    np.testing.assert_array_equal(sf.read(part, dtype="float64")[0], expected)
    assert sf.info(part).subtype == ("FLOAT" if kind == "VORBIS" else kind)


def test_periods_end_with_the_interval():
    settings = SegmentSettings(period_s=0.1)
    parts = cut_by_period(Segment(0, 1), settings)
    assert len(parts) == 10
    assert parts[2] == Segment(0.2, 0.3)
    assert cut_by_period(Segment(0, 0.95), settings)[-1] == Segment(0.8, 0.9)
    assert cut_by_period(Segment(0, 0.05), settings) == []


def test_a_track_with_byte_order_mark_and_windows_line_ends(tmp_path):
    path = tmp_path / "a.txt"
    path.write_bytes("\ufeff2.5\t3.5\tspät\r\n0\t1\r\n".encode())
    assert read_label_track(path) == [(0.0, 1.0, ""), (2.5, 3.5, "spät")]
    with pytest.raises(DataError, match="no such file"):
        read_label_track(tmp_path / "b.txt")


def test_a_session_without_segments_has_no_columns_for_them(project):
    project.write([Recording(recording_id="a", file="a.wav", grasp_id="a")])
    header = (project.folder() / "recordings.csv").read_text().splitlines()[0]
    assert "start_s" not in header


def test_the_declaration_has_the_rules(imported, project):
    content = yaml.safe_load(project.paths.dataset(NAME).read_text())
    assert content["imports"] == {"segments": {"labels": "track"}}
