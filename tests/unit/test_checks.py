import numpy as np
import pytest
import soundfile as sf
from hypothesis import given, settings
from hypothesis import strategies as st

from ajgdata.features.checks import check_audio, check_samples
from ajgdata.store.audio import read_audio
from ajgdata.types import AudioSettings

WINDOW = 2048
TIME_S = np.arange(44_100) / 44_100


def sine(amplitude=0.5, frequency_hz=440.0):
    return (amplitude * np.sin(2 * np.pi * frequency_hz * TIME_S)).astype(np.float32)


def quantised(samples, bits):
    """What an ideal converter of so many bits makes of samples: it saturates."""
    steps = 2.0 ** (bits - 1)
    return (np.clip(np.rint(samples * steps), -steps, steps - 1) / steps).astype(np.float32)


def codes(samples, subtype="FLOAT"):
    remarks = check_samples(samples, subtype, WINDOW)
    assert all(r.problem and r.fix and "\n" not in r.problem + r.fix for r in remarks)
    return [(r.level, r.code) for r in remarks]


def with_value(value, index):
    samples = sine()
    samples[index] = value
    return samples


ERRORS = {
    "short": (
        sine()[: WINDOW - 1],
        "too_short",
        "2047 samples are fewer than the 2048 of a feature",
    ),
    "nan": (with_value(np.nan, [77, 99]), "not_finite", "2 samples are NaN or infinite"),
    "inf": (with_value(-np.inf, [123]), "not_finite", "the first at index 123"),
    "zero": (np.zeros(9000, np.float32), "silent", "zero"),
    "denormal": (sine() * np.float32(1e-40), "too_quiet", "peak"),
    "offset": (np.full(9000, 0.25, np.float32), "constant", "every sample is 0.25"),
    "stereo offset": (np.full((9000, 2), [0.5, 0.0], np.float32), "constant", "offset"),
    "stereo nan": (np.c_[sine(), with_value(np.nan, [5])], "not_finite", "index 5"),
}


@pytest.mark.parametrize("name", ERRORS)
def test_unusable_samples_have_one_error(name):
    samples, code, problem = ERRORS[name]
    remarks = check_samples(samples, "FLOAT", WINDOW)
    assert [(r.level, r.code) for r in remarks] == [("error", code)]
    assert problem in remarks[0].problem


@pytest.mark.parametrize("bits", [8, 16, 24, 32])
@pytest.mark.parametrize("frequency_hz", [20.0, 440.0, 5_000.0])
def test_converters_clip_at_full_scale(bits, frequency_hz):
    subtype = "PCM_U8" if bits == 8 else f"PCM_{bits}"
    fine = quantised(sine(0.95, frequency_hz), bits)
    assert codes(fine, subtype) == []
    clipped = quantised(sine(1.5, frequency_hz), bits)
    assert codes(clipped, subtype) == [("warning", "clipped")]


def test_number_of_clipped_samples_is_right():
    samples = sine(0.3)
    highest = 1 - 2.0**-15
    samples[100:103] = highest
    samples[200:210] = -1
    samples[300:302] = highest  # two may be a coincidence
    (remark,) = check_samples(samples, "PCM_16", WINDOW)
    assert remark.problem.startswith("13 samples")


def test_float_samples_beyond_full_scale_are_not_clipped_by_that():
    assert codes(sine(18)) == [("note", "beyond_full_scale")]
    assert codes(sine(1.0)) == []
    assert codes(sine(1.1e-4)) == []
    assert codes(sine(0.9e-4)) == [("warning", "quiet")]


@pytest.mark.parametrize("level", [0.2, 1.0, 7.0])
def test_flat_tops_show_in_float_samples_at_any_level(level):
    flat = np.clip(sine(1.3 * level), -level, level)
    expected = [("warning", "clipped")]
    expected += [("note", "beyond_full_scale")] if level > 1 else []
    assert codes(flat) == expected
    one_sided = np.minimum(sine(1.3 * level), np.float32(level))
    assert ("warning", "clipped") in codes(one_sided)


@settings(deadline=None)
@given(st.floats(5, 3000), st.floats(0.05, 0.9), st.sampled_from([8, 12, 16]))
def test_quantised_tones_in_float_files_are_not_clipped(frequency_hz, amplitude, bits):
    """The flat tops of slow tones come from quantisation alone."""
    assert codes(quantised(sine(amplitude, frequency_hz), bits)) == []


def checked(tmp_path, samples, subtype, rate=44_100):
    sf.write(tmp_path / "a.wav", samples, rate, subtype=subtype)
    settings = AudioSettings(microphone="mean", other_rate="resample")
    return [r.code for r in check_audio(read_audio(tmp_path / "a.wav", settings), WINDOW)]


def test_clipping_shows_despite_conversion(tmp_path):
    both = np.c_[sine(0.5), sine(1.5).clip(-1, 1)]
    expected = ["channel_converted", "resampled", "clipped"]
    assert checked(tmp_path, both, "PCM_16", 48_000) == expected


def test_samples_must_suffice_after_conversion(tmp_path):
    assert checked(tmp_path, sine()[:2100], "PCM_16", 48_000) == ["resampled", "too_short"]
    assert checked(tmp_path, sine()[:2000], "PCM_16", 32_000) == ["resampled"]


def test_opposite_channels_average_to_silence(tmp_path):
    both = np.c_[sine(), -sine()]
    assert checked(tmp_path, both, "FLOAT") == ["channel_converted", "silent"]


@pytest.mark.parametrize(("amplitude", "remarks"), [(0.5e-4, [("warning", "quiet")]), (2e-4, [])])
def test_an_offset_hides_no_quiet_recording(amplitude, remarks):
    """The limit is a peak of 1e-4. Opposite offsets of two channels, or a channel that is quieter
    than the other, do not count: the loudest channel decides, without its offset."""
    tone = sine(amplitude)
    offset = [("warning", "offset")]
    assert codes(tone + np.float32(0.3)) == remarks + offset
    opposite = np.column_stack([tone + np.float32(0.3), tone - np.float32(0.3)])
    assert codes(opposite) == remarks + offset
    assert codes(np.column_stack([tone, tone * np.float32(0.01)])) == remarks


def test_each_of_several_microphones_is_checked():
    quiet = sine(0.5e-4)
    clipped = quantised(sine(1.5), 16)
    silent = np.zeros_like(quiet)

    def remarks(*columns, numbers=(1, 3, 4)):
        samples = np.stack(columns, axis=1)
        found = check_samples(samples, "PCM_16", WINDOW, microphones=numbers)
        return [(r.level, r.code, r.problem.split(":")[0]) for r in found]

    fine = quantised(sine(), 16)
    assert remarks(fine, fine, fine) == []
    assert remarks(fine, silent, fine) == [("error", "silent", "microphone 3")]
    assert remarks(silent, fine, silent) == [("error", "silent", "microphones 1 and 4")]
    assert remarks(fine, quiet, clipped) == [
        ("warning", "quiet", "microphone 3"),
        ("warning", "clipped", "microphone 4"),
    ]
    (every,) = remarks(silent, silent, silent)
    assert every == ("error", "silent", "every sample is zero")
    with_nan = fine.copy()
    with_nan[5] = np.nan
    assert remarks(fine, clipped, with_nan) == [("error", "not_finite", "microphone 4")]


def test_a_dead_channel_of_the_mean_is_a_warning(tmp_path):
    """The mean of a sound and of silence has half of its level."""
    dead = np.c_[sine(), np.zeros_like(sine())]
    assert checked(tmp_path, dead, "FLOAT") == ["channel_converted", "dead_channel"]


def test_a_dead_microphone_is_found_after_resampling(tmp_path):
    path = tmp_path / "two.wav"
    sf.write(path, np.c_[sine(), np.full_like(sine(), 0.25)], 44_100, subtype="FLOAT")
    settings = AudioSettings(sample_rate_hz=16_000, microphone=(1, 2), other_rate="resample")
    remarks = check_audio(read_audio(path, settings), WINDOW, microphones=(1, 2))
    errors = [(r.code, r.problem) for r in remarks if r.level == "error"]
    assert errors == [
        ("constant", "microphone 2: every sample is 0.25: no sound, only an offset"),
    ]
