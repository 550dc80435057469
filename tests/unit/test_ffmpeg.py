"""Decoding of M4A and AAC: known samples, damaged files, and a missing package."""

import io
import sys

import numpy as np
import pytest
import soundfile as sf

from ajgdata.store import ffmpeg
from ajgdata.store.audio import AudioError, inspect_audio, read_audio
from ajgdata.store.freshness import tables_digest
from ajgdata.types import AudioSettings, DataError, Segment, extras

av = pytest.importorskip("av", reason="the extra audio is not installed")
RATE_HZ = 48_000
ANY = AudioSettings(sample_rate_hz=RATE_HZ, microphone="mean")


def chirp(seconds: float = 1.5, channels: int = 1) -> np.ndarray:
    """Return a sweep (frames, channels) from 200 Hz to 5 kHz, which AAC encodes with few errors."""
    time = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    phase = 2 * np.pi * (200 * time + 2400 * time**2 / seconds)
    return 0.5 * np.stack([np.sin(phase + channel) for channel in range(channels)], axis=1)


def encoded(samples: np.ndarray, container: str = "ipod", codec: str = "aac") -> bytes:
    """Return samples (frames, channels) as a file; `ipod` is FFmpeg's name of M4A."""
    stream = io.BytesIO()
    layout = {1: "mono", 2: "stereo"}[samples.shape[1]]
    with av.open(stream, "w", format=container) as file:
        out = file.add_stream(codec, rate=RATE_HZ, layout=layout)
        if codec == "aac":
            out.bit_rate = 256_000
        size = out.codec_context.frame_size or 1024
        for start in range(0, len(samples), size):
            values = np.ascontiguousarray(samples[start : start + size].T, np.float32)
            kind = "fltp" if codec == "aac" else "s16p"
            if codec == "alac":
                values = np.rint(values * 2**15).astype(np.int16)
            frame = av.AudioFrame.from_ndarray(values, format=kind, layout=layout)
            frame.sample_rate = RATE_HZ
            frame.pts = start
            file.mux(out.encode(frame))
        file.mux(out.encode(None))
    return stream.getvalue()


@pytest.mark.parametrize("channels", [1, 2])
def test_an_m4a_file_has_the_samples_of_the_sound_without_delay(tmp_path, channels):
    sound = chirp(channels=channels)
    path = tmp_path / "a.m4a"
    path.write_bytes(encoded(sound))
    got = read_audio(path, ANY)
    assert (got.info.format, got.info.subtype, got.info.channels) == ("MOV", "AAC", channels)
    assert got.info.sample_rate_hz == RATE_HZ
    # AAC fills its last block of 1024 samples; without its delay, the sounds are equal.
    assert 0 <= got.info.frames - len(sound) < 1024
    error = got.recorded[2048 : len(sound) - 2048] - sound[2048:-2048]
    assert np.sqrt(np.mean(error**2)) < 0.01 * np.sqrt(np.mean(sound**2))
    assert inspect_audio(path) == got.info


def test_lossless_m4a_has_exactly_the_encoded_samples(tmp_path):
    sound = np.rint(chirp() * 2**15) / 2**15
    path = tmp_path / "a.m4a"
    path.write_bytes(encoded(sound, codec="alac"))
    np.testing.assert_array_equal(read_audio(path, ANY).recorded, sound.astype(np.float32))


def test_a_segment_of_an_m4a_file_is_a_slice_of_the_whole(tmp_path):
    path = tmp_path / "a.m4a"
    path.write_bytes(encoded(chirp()))
    whole = read_audio(path, ANY).samples
    part = read_audio(path, ANY, Segment(0.25, 0.75))
    np.testing.assert_array_equal(part.samples, whole[12_000:36_000])
    path.write_bytes(encoded(-chirp()))  # not the samples that are in memory
    changed = read_audio(path, ANY, Segment(0.25, 0.75))
    assert np.corrcoef(changed.samples, part.samples)[0, 1] < -0.99


def test_an_aac_stream_is_read(tmp_path):
    path = tmp_path / "a.aac"
    path.write_bytes(encoded(chirp(), container="adts"))
    assert read_audio(path, ANY).info.subtype == "AAC"


def test_no_cut_of_an_m4a_file_goes_unnoticed(tmp_path):
    content = encoded(chirp())
    path = tmp_path / "a.m4a"
    codes = set()
    for size in range(0, len(content), 501):
        path.write_bytes(content[:size])
        with pytest.raises(AudioError) as error:
            read_audio(path, ANY)
        codes.add(error.value.remark.code)
        if size >= ffmpeg.HEAD_BYTES:
            assert error.value.remark.code == "truncated"
    assert codes == {"empty", "truncated"}


def test_a_damaged_m4a_file_is_an_error(tmp_path):
    content = bytearray(encoded(chirp()))
    place = content.index(b"stsd")
    content[place : place + 60] = bytes(60)
    path = tmp_path / "a.m4a"
    path.write_bytes(content)
    with pytest.raises(AudioError, match="FFmpeg") as error:
        read_audio(path, ANY)
    assert error.value.remark.code in ("damaged", "no_samples")


def test_a_missing_package_is_one_line_with_the_command(tmp_path, monkeypatch):
    path = tmp_path / "a.m4a"
    path.write_bytes(encoded(chirp()))
    monkeypatch.setitem(sys.modules, "av", None)
    monkeypatch.setattr(extras, "extras", lambda: ["audio"])
    monkeypatch.setattr(extras, "packages_of", lambda extra: ["av"])
    with pytest.raises(DataError) as error:
        read_audio(path, ANY)
    assert error.value.problem == "av is not installed"
    assert error.value.fix == 'run `pip install "ajgdata[audio]"`'


def test_another_version_of_ffmpeg_computes_only_its_files_again(project, monkeypatch):
    settings = AudioSettings(sample_rate_hz=RATE_HZ)
    rows = project.session("s1", {"a": 500.0, "b": 600.0})
    audio_folder = project.folder() / "audio"
    sf.write(audio_folder / "a.wav", chirp(), RATE_HZ)
    (audio_folder / "b.m4a").write_bytes(encoded(chirp()))
    files = {"a": "audio/a.wav", "b": "audio/b.m4a"}
    rows = [row.model_copy(update={"file": files[row.recording_id], "sha256": ""}) for row in rows]
    project.write(rows)
    folder = project.folder()
    assert project.build("s1", audio=settings) == (2, 0)
    assert project.build("s1", audio=settings) == (0, 2)
    before = tables_digest(folder)
    for module in ("ajgdata.pipeline.feature_file", "ajgdata.store.freshness"):
        monkeypatch.setattr(f"{module}.installed_version", lambda package: "99.0")
    assert tables_digest(folder) != before
    assert project.build("s1", audio=settings) == (1, 1)
    assert project.build("s1", audio=settings) == (0, 2)
    project.write(rows[:1])
    without = tables_digest(folder)
    monkeypatch.undo()
    assert tables_digest(folder) == without
