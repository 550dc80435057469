import io
import struct

import numpy as np
import pytest
import soundfile as sf
from hypothesis import given, settings
from hypothesis import strategies as st

from ajgdata.store.audio import (
    AudioError,
    file_sha256,
    inspect_audio,
    read_audio,
    resample,
    write_pcm24,
)
from ajgdata.types import AudioSettings, Segment
from ajgdata.types.errors import sentence

AS_IS = AudioSettings()
ANY = AudioSettings(microphone="mean", other_rate="resample")
CODES = np.array([0, 1, -1, 2, -32768, 32767, 12345, -4321, 77], dtype="<i2")
DATA = CODES.tobytes()


def chunk(name: bytes, data: bytes, declared: int | None = None) -> bytes:
    padding = b"\0" * (len(data) & 1)
    return name + struct.pack("<I", len(data) if declared is None else declared) + data + padding


def wave(data=DATA, *, declared=None, riff=None, channels=1, rate=44_100, bits=16):
    """A WAV file made by hand, as wrong as the arguments ask."""
    frame = channels * bits // 8
    fmt = struct.pack("<HHIIHH", 1, channels, rate, rate * frame % 2**32, frame, bits)
    body = b"WAVE" + chunk(b"fmt ", fmt) + chunk(b"data", data, declared)
    return b"RIFF" + struct.pack("<I", len(body) if riff is None else riff) + body


@pytest.fixture
def put(tmp_path):
    def _put(content: bytes, name="a.wav"):
        path = tmp_path / name
        path.write_bytes(content)
        return path

    return _put


def noise(frames, channels=1, seed=0):
    return np.random.default_rng(seed).uniform(-0.9, 0.9, (frames, channels))


def encoded(samples, rate=44_100, **kind) -> bytes:
    stream = io.BytesIO()
    sf.write(stream, samples, rate, **kind)
    return stream.getvalue()


PLAIN = ["PCM_U8", "PCM_16", "PCM_24", "PCM_32", "FLOAT", "DOUBLE", "ULAW"]
WAV_KINDS = [("WAV", "IMA_ADPCM"), *((c, subtype) for c in ("WAV", "WAVEX") for subtype in PLAIN)]


@pytest.mark.parametrize("channels", [1, 2])
@pytest.mark.parametrize(("container", "subtype"), WAV_KINDS)
def test_every_wav_encoding_is_libsndfile_sample_for_sample(put, container, subtype, channels):
    path = put(encoded(noise(1001, channels), format=container, subtype=subtype))
    expected = sf.read(path, dtype="float32", always_2d=True)[0]
    got = read_audio(path, ANY)
    assert got.recorded.dtype == got.samples.dtype == np.float32
    np.testing.assert_array_equal(got.recorded, expected)
    np.testing.assert_array_equal(got.samples, expected.mean(axis=1))
    assert (got.info.subtype, got.info.channels) == (subtype, channels)
    assert got.info.frames == len(expected)


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("a.flac", {"format": "FLAC", "subtype": "PCM_24"}),
        ("ogg inside.wav", {"format": "OGG", "subtype": "VORBIS"}),
        ("a.mp3", {"format": "MP3", "subtype": "MPEG_LAYER_III"}),
        ("a.aif", {"format": "AIFF", "subtype": "PCM_24"}),
    ],
)
def test_other_containers(put, name, kind):
    path = put(encoded(noise(5000), **kind), name)
    got = read_audio(path, AS_IS)
    np.testing.assert_array_equal(got.samples, sf.read(path, dtype="float32")[0])
    assert (got.info.format, got.info.subtype) == (kind["format"], kind["subtype"])
    assert got.remarks == ()


@pytest.mark.parametrize(
    ("container", "subtype"),
    [
        ("WAV", "PCM_16"),
        ("WAV", "FLOAT"),
        ("WAV", "IMA_ADPCM"),
        ("FLAC", "PCM_24"),
        ("AIFF", "PCM_16"),
        ("OGG", "VORBIS"),
        ("MP3", "MPEG_LAYER_III"),
    ],
)
def test_a_segment_is_a_slice_of_the_whole(put, container, subtype):
    path = put(encoded(noise(44_100, 2), format=container, subtype=subtype))
    whole = read_audio(path, ANY)
    for start, end in ((0, 0.5), (0.25, 0.75), (0.100003, 0.9)):
        first = round(start * 44_100)
        last = round(end * 44_100)
        got = read_audio(path, ANY, Segment(start, end))
        np.testing.assert_array_equal(got.recorded, whole.recorded[first:last])
        assert got.info.frames == last - first
        assert inspect_audio(path, Segment(start, end)) == got.info
    np.testing.assert_array_equal(
        read_audio(path, ANY, Segment(0.5)).samples, whole.samples[22050:]
    )


@pytest.mark.parametrize(
    ("segment", "code", "problem"),
    [
        (Segment(0.5, 1.1), "beyond_end", "the segment 0.5 to 1.1 s is not within the file"),
        (Segment(1.0), "beyond_end", "the segment 1 to the end is not within the file"),
        (Segment(0.5, 0.500001), "no_samples", "the segment 0.5 to 0.500001 s has no samples"),
    ],
)
def test_a_segment_that_the_file_does_not_have(put, segment, code, problem):
    path = put(encoded(noise(44_100), format="WAV"))
    with pytest.raises(AudioError) as caught:
        read_audio(path, AS_IS, segment)
    assert caught.value.remark.code == code
    assert caught.value.problem.startswith(problem)
    assert caught.value.fix == "correct start_s and end_s in recordings.csv"
    with pytest.raises(AudioError):
        inspect_audio(path, segment)


@settings(deadline=None, max_examples=15)
@given(st.lists(st.integers(-(2**23), 2**23 - 1), min_size=1, max_size=50))
def test_all_24_bit_codes_survive_writing_and_reading(tmp_path_factory, codes):
    path = tmp_path_factory.getbasetemp() / "codes.wav"
    samples = np.array(codes) / 2**23
    write_pcm24(path, samples, 44_100)
    np.testing.assert_array_equal(read_audio(path, AS_IS).samples, samples)
    np.testing.assert_array_equal(sf.read(path)[0], samples)
    assert (path.stat().st_size - 44 - 3 * len(codes)) == len(codes) % 2  # header, data, padding


@pytest.mark.parametrize("bad", [[0, 1.001], [np.nan, 0], [], [[0.1], [0.2]]])
def test_write_refuses_what_it_would_have_to_alter(tmp_path, bad):
    with pytest.raises(ValueError, match=r"full scale|shape"):
        write_pcm24(tmp_path / "a.wav", np.array(bad, dtype=float), 44_100)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("declared", [0xFFFFFFFF, 0x7FFFF000])
@pytest.mark.parametrize("bits", [8, 16])
def test_streams_that_leave_the_length_open_are_read_to_the_end(put, declared, bits):
    data = bytes(range(100, 118))
    got = read_audio(put(wave(data, declared=declared, riff=0xFFFFFFFF, bits=bits)), AS_IS)
    dtype, scale, offset = ("<i2", 32768, 0) if bits == 16 else ("u1", 128, 128)
    expected = (np.frombuffer(data, dtype).astype(float) - offset) / scale
    np.testing.assert_array_equal(got.samples, expected)


def refusal(path, audio=AS_IS) -> AudioError:
    with pytest.raises(AudioError) as caught:
        read_audio(path, audio)
    error = caught.value
    assert str(error) == f"{path}: {error.problem}. {sentence(error.fix)}"
    return error


BROKEN = {
    "empty": (b"", "empty", "record it again"),
    "text": (b"hello, this is no audio at all\n" * 9, "damaged", "convert it"),
    "header only": (wave(b""), "no_samples", "record it again"),
    "cut in header": (wave()[:30], "damaged", "record it again"),
    "cut 16": (wave()[:-2], "truncated", "record it again"),
    "999 Hz": (wave(rate=999), "implausible", "correct its header"),
    "300 channels": (wave(bytes(1200), channels=300, bits=8), "implausible", "correct its header"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_files_are_refused_with_a_remedy(put, name):
    content, code, fix = BROKEN[name]
    path = put(content)
    error = refusal(path)
    assert error.remark.code == code
    assert fix in error.fix
    with pytest.raises(AudioError):
        inspect_audio(path)


def test_damage_is_described_in_the_words_of_libsndfile(put):
    assert refusal(put(BROKEN["text"][0])).problem.endswith("reads (Format not recognised)")


def test_missing_file_and_folder(tmp_path):
    assert refusal(tmp_path / "none.wav").remark.code == "missing"
    assert refusal(tmp_path).remark.code == "missing"
    with pytest.raises(AudioError, match="no such file"):
        file_sha256(tmp_path / "none.wav")


@settings(deadline=None, max_examples=20)
@given(st.data())
def test_no_cut_goes_unnoticed(tmp_path_factory, data):
    """Wherever a copy was interrupted, the file is refused."""
    kinds = ("WAV PCM_16", "WAVEX PCM_24", "WAV FLOAT", "WAV IMA_ADPCM", "FLAC PCM_16")
    container, subtype = data.draw(st.sampled_from(kinds)).split()
    whole = encoded(noise(3000), format=container, subtype=subtype)
    path = tmp_path_factory.getbasetemp() / "cut.wav"
    path.write_bytes(whole[: data.draw(st.integers(0, len(whole) - 1))])
    with pytest.raises(AudioError):
        read_audio(path, AS_IS)


def test_rate_and_channels_are_rejected_unless_declared(put):
    path = put(encoded(noise(4800, 2), 48_000, format="WAV", subtype="PCM_16"))
    assert "audio.other_rate: resample" in refusal(path).fix
    assert (
        refusal(path, AudioSettings(sample_rate_hz=48_000, microphone=3)).remark.code == "channels"
    )


def test_conversions_do_what_they_say_and_are_reported(put):
    samples = noise(4800, 2)
    path = put(encoded(samples, 48_000, format="WAV", subtype="DOUBLE"))
    left = read_audio(path, AudioSettings(sample_rate_hz=48_000, microphone=1))
    np.testing.assert_array_equal(left.samples, samples[:, 0].astype(np.float32))
    right = read_audio(path, AudioSettings(sample_rate_hz=48_000, microphone=2))
    np.testing.assert_array_equal(right.samples, samples[:, 1].astype(np.float32))
    both = read_audio(path, ANY)
    assert both.samples.shape == (4410,)
    assert both.recorded.shape == (4800, 2)
    assert [r.code for r in both.remarks] == ["channel_converted", "resampled"]
    assert "48000 to 44100 Hz" in both.remarks[1].problem


@pytest.mark.parametrize("from_hz", [22_254, 44_101, 48_000])
def test_resampling_keeps_a_tone(from_hz):
    """A tone in the pass band keeps frequency, amplitude and phase.

    The filter is a Kaiser window of beta 5, whose ripple is 10**(-(5 / 0.1102 + 8.7) / 20) = 0.0020
    (Oppenheim & Schafer); pass band and images add up to two of it. The ends see zeros outside.
    """
    tone_hz = 1234.5
    to_hz = 44_100
    played = np.sin(2 * np.pi * tone_hz * np.arange(from_hz) / from_hz).astype(np.float32)
    got = resample(played, from_hz, to_hz)
    assert got.dtype == np.float32
    expected = np.sin(2 * np.pi * tone_hz * np.arange(len(got)) / to_hz)
    assert len(got) == to_hz
    assert np.abs(got - expected)[100:-100].max() < 2 * 0.0020
