"""`ajgdata import --convert`: what is not read as it is becomes a new file, and only that."""

import stat
import sys

import numpy as np
import pytest
import soundfile as sf
from worlds import RATE_HZ, tone, write_tone

from ajgdata.paths import Paths
from ajgdata.pipeline.importing import import_folder
from ajgdata.store.audio import file_sha256, read_audio
from ajgdata.store.sessions import read_recordings
from ajgdata.types import AudioSettings, DataError

#: A program called ffmpeg that decodes "M4A" + samples (float32, mono, 8 kHz) to its output.
FFMPEG = f"""#!{sys.executable}
import struct, sys
if "-version" in sys.argv:
    print("ffmpeg version 9.9-test Copyright")
    sys.exit()
path = sys.argv[sys.argv.index("-i") + 1]
assert path.startswith("file:/"), path
data = open(path[5:], "rb").read()
if data[:3] != b"M4A":
    sys.exit("moov atom not found")
size = 2**32 - 1
fmt = struct.pack("<HHIIHH", 3, 1, {RATE_HZ}, 4 * {RATE_HZ}, 4, 32)
head = b"RIFF" + struct.pack("<I", size) + b"WAVEfmt " + struct.pack("<I", 16) + fmt
sys.stdout.buffer.write(head + b"data" + struct.pack("<I", size) + data[3:])
"""


@pytest.fixture
def paths(tmp_path):
    (tmp_path / "project" / "datasets").mkdir(parents=True)
    return Paths(tmp_path / "project")


@pytest.fixture
def ffmpeg(tmp_path, monkeypatch):
    program = tmp_path / "bin" / "ffmpeg"
    program.parent.mkdir()
    program.write_text(FFMPEG)
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", str(program.parent))


def convert(paths, folder, **options):
    return import_folder(paths, "d", folder, settings=None, convert=True, **options)


def rows(paths, session="kit"):
    return {r.recording_id: r for r in read_recordings(paths.session("d", session))[0]}


def samples_of(paths, row):
    path = paths.session("d", "kit") / row.file
    return read_audio(path, AudioSettings(sample_rate_hz=RATE_HZ, channel="mean")).samples


def test_what_libsndfile_reads_is_decoded_sample_for_sample(paths, tmp_path):
    folder = tmp_path / "kit"
    folder.mkdir()
    both = np.stack([tone(500), tone(700)], axis=1)
    sf.write(folder / "1_cube.aiff", both, RATE_HZ, subtype="PCM_24")
    sf.write(folder / "2_ball.w64", 3 * tone(600), RATE_HZ, subtype="FLOAT")
    sf.write(folder / "3_mug.wav", tone(650), RATE_HZ, format="AIFF", subtype="PCM_16")
    write_tone(folder / "4_cup.wav", 800)
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    spec, found, result = convert(paths, folder)
    assert (result.added, result.decoded, found.skipped, result.failed) == (4, 3, [], [])
    held = rows(paths)
    assert held["1_cube"].file == "audio/1_cube.aiff.wav"
    assert held["3_mug"].file == "audio/3_mug.wav.wav"
    for row, name in ((held["1_cube"], "1_cube.aiff"), (held["2_ball"], "2_ball.w64")):
        expected = sf.read(folder / name, dtype="float32", always_2d=True)[0].mean(axis=1)
        np.testing.assert_array_equal(samples_of(paths, row), expected)
        assert row.labels["decoded_from"].startswith(f"{name} (libsndfile")
        assert row.sha256 == file_sha256(paths.session("d", "kit") / row.file)
    assert held["4_cup"].labels["decoded_from"] == ""
    assert spec.audio == AudioSettings(sample_rate_hz=RATE_HZ)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    result = convert(paths, folder)[2]
    assert (result.unchanged, result.decoded, result.conflicts) == (4, 0, [])


def test_ffmpeg_decodes_what_libsndfile_cannot(paths, tmp_path, ffmpeg):
    folder = tmp_path / "kit"
    folder.mkdir()
    heard = tone(500).astype(np.float32)
    (folder / "1_-cube.m4a").write_bytes(b"M4A" + heard.tobytes())
    (folder / "2_ball.m4a").write_bytes(b"broken")
    spec, _, result = convert(paths, folder)
    row = rows(paths)["1_-cube"]
    np.testing.assert_array_equal(samples_of(paths, row), heard)
    assert row.labels["decoded_from"] == "1_-cube.m4a (ffmpeg 9.9-test)"
    assert spec.audio.sample_rate_hz == RATE_HZ
    assert result.failed == [
        ("2_ball.m4a", "ffmpeg cannot decode it (moov atom not found); fetch a whole copy, or "
         "leave it out")
    ]  # fmt: skip
    assert [p.name for p in (paths.session("d", "kit") / "audio").iterdir()] == ["1_-cube.m4a.wav"]
    (folder / "1_-cube.m4a").write_bytes(b"M4A" + (2 * heard).tobytes())
    assert convert(paths, folder)[2].conflicts == ["1_-cube"]
    assert convert(paths, folder, on_change="files")[2].decoded == 1
    np.testing.assert_array_equal(samples_of(paths, rows(paths)["1_-cube"]), 2 * heard)


def test_without_ffmpeg_the_remedy_is_to_install_it(paths, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    write_tone(tmp_path / "kit" / "1_cube.wav", 500)
    (tmp_path / "kit" / "2_ball.m4a").write_bytes(b"....ftypM4A ")
    result = convert(paths, tmp_path / "kit")[2]
    assert (result.added, len(result.failed)) == (1, 1)
    assert result.failed[0][1].endswith("install ffmpeg, then import again")


def test_a_sound_beside_its_own_conversion_is_not_imported_twice(paths, tmp_path, ffmpeg):
    """The same event in two files would stand on both sides of a split."""
    write_tone(tmp_path / "kit" / "21_cube.wav", 500)
    (tmp_path / "kit" / "21_cube.m4a").write_bytes(b"M4A" + tone(500).astype("<f4").tobytes())
    _, found, result = convert(paths, tmp_path / "kit")
    assert (result.added, result.decoded) == (1, 0)
    assert [name for name, _ in found.skipped] == ["21_cube.m4a"]


def test_references_cannot_be_converted(paths, tmp_path, snapshot):
    write_tone(tmp_path / "kit" / "1_cube.wav", 500)
    before = snapshot(paths.root)
    with pytest.raises(DataError, match="--convert: makes new files; import without --reference"):
        convert(paths, tmp_path / "kit", copy=False)
    assert snapshot(paths.root) == before
