"""Defects of the signal: found at twice their limit, not at half of it, nor in sound signals."""

from __future__ import annotations

import numpy as np
import pytest

from ajgdata.features.checks import check_samples
from ajgdata.features.encoding import check_encoding
from ajgdata.features.gaps import MIN_BUFFER, MIN_QUANTA, check_gaps
from ajgdata.features.hum import MAINS_HZ, check_hum
from ajgdata.features.levels import JUMP_DB, SWAP_DB, level_jumps, swapped_channels
from ajgdata.features.offset import check_offset
from ajgdata.features.repeats import check_repeats
from ajgdata.features.segments import segments
from ajgdata.features.share import LINE_GAIN, OFFSET_GAIN, SHARE_LIMIT, share
from ajgdata.types.features import reaching_hz

RATE_HZ = 44_100
TIME_S = np.arange(RATE_HZ) / RATE_HZ
QUANTUM = 2.0**-15


def noise(seed=1, count=RATE_HZ, level=0.1):
    return (level * np.random.default_rng(seed).normal(size=count)).astype(np.float32)


def sweep():
    """A logarithmic sweep of one second from 20 Hz to 20 kHz, with noise of -60 dB."""
    phase = 2 * np.pi * 20 / np.log(1000) * (1000**TIME_S - 1)
    return (0.1 * np.sin(phase)).astype(np.float32) + noise(level=1e-4)


def quantised(samples):
    return (np.rint(samples / QUANTUM) * QUANTUM).astype(np.float32)


def component(other, part):
    """Return the gain times amplitude that has a share of `part` in the spectrum."""
    return part / (1 - part) * (1 / share(1, other, RATE_HZ) - 1)


def checked(check, samples):
    return check(samples, segments(samples, RATE_HZ), RATE_HZ)


def test_share_of_an_offset_is_that_of_the_two_lowest_bins():
    """An offset of 0.3 has 3/4 * 0.3 of the 1-norm, in units of the window."""
    other = noise()
    expected = OFFSET_GAIN * 0.3
    total = expected / share(expected, other, RATE_HZ)
    # white noise of deviation s: sqrt(pi 3 N / 8) s / 2 in each of N / 2 + 1 bins
    bins = 0.1 * np.sqrt(np.pi * 3 * 2048 / 8) / 2 * 1025 / 2048
    assert total - expected == pytest.approx(bins, rel=0.02)


@pytest.mark.parametrize("signal", [noise, sweep])
@pytest.mark.parametrize(("factor", "code"), [(0.5, None), (2, "offset")])
def test_an_offset_is_found_above_its_share(signal, factor, code):
    sound = signal()
    offset = component(sound, factor * SHARE_LIMIT) / OFFSET_GAIN
    for sign in (-1, 1):
        result = checked(check_offset, (sound + sign * offset).astype(np.float32))
        assert (result and result.code) == code


def test_a_low_tone_is_no_offset():
    for hertz in (3.5, 7, 15):
        assert checked(check_offset, np.sin(2 * np.pi * hertz * TIME_S).astype(np.float32)) is None


@pytest.mark.parametrize("mains_hz", MAINS_HZ)
@pytest.mark.parametrize(("factor", "code"), [(0.5, None), (2, "hum")])
def test_hum_is_found_above_its_share(mains_hz, factor, code):
    sound = sweep()
    lines = [np.sin(2 * np.pi * mains_hz * n * TIME_S + n) for n in (1, 2, 3)]
    amplitude = component(sound, factor * SHARE_LIMIT) / LINE_GAIN / len(lines)
    samples = (sound + amplitude * np.sum(lines, axis=0)).astype(np.float32)
    result = checked(check_hum, samples)
    assert (result and result.code) == code
    if result:
        assert f"mains hum of {mains_hz} Hz" in result.problem


@pytest.mark.parametrize(
    "samples",
    [
        sweep(),
        noise(),
        0.5 * np.sin(2 * np.pi * 50 * TIME_S),  # a single tone
        np.clip(2 * np.sin(2 * np.pi * 20 * TIME_S), -1, 1),  # its third harmonic has 60 Hz
        np.sin(2 * np.pi * 50 * TIME_S) ** 3 * np.exp(-8 * TIME_S),  # a sound that decays
    ],
)
def test_sounds_at_the_frequency_of_the_mains_are_no_hum(samples):
    assert checked(check_hum, samples.astype(np.float32)) is None


@pytest.mark.parametrize(("count", "code"), [(MIN_BUFFER // 2, None), (2 * MIN_BUFFER, "gap")])
def test_a_gap_is_found_if_it_has_the_length_of_a_buffer(count, code):
    samples = quantised(noise())
    samples[5000 : 5000 + count] = 0
    result = check_gaps(samples, QUANTUM)
    assert (result and result.code) == code


@pytest.mark.parametrize(("quanta", "code"), [(MIN_QUANTA / 2, None), (2 * MIN_QUANTA, "gap")])
def test_a_gap_has_sound_on_both_sides(quanta, code):
    samples = np.tile(np.float32([1, -1]), 1000) * np.float32(quanta * QUANTUM)
    samples[0] = QUANTUM
    samples[800:1000] = 0
    result = check_gaps(samples, QUANTUM)
    assert (result and result.code) == code


def test_silence_at_the_ends_and_after_a_fade_is_no_gap():
    fade = quantised(noise(count=20_000) * np.exp(-np.arange(20_000) / 1000))
    silence = np.zeros(2000, np.float32)
    assert check_gaps(np.r_[silence, fade, silence], QUANTUM) is None
    assert check_gaps(np.r_[fade, silence, fade, silence], QUANTUM) is None


def test_all_gaps_are_counted_and_the_first_is_described():
    samples = quantised(noise())
    samples[3000:3100] = 0
    samples[9000:9500] = 0
    assert "2 gaps of zeros" in check_gaps(samples, QUANTUM).problem
    assert "the first of 100 samples at 3000" in check_gaps(samples, QUANTUM).problem


@pytest.mark.parametrize("length", [128, 441, 1024, 3000])
@pytest.mark.parametrize("level", [0.1, 20 * QUANTUM])
def test_a_block_that_follows_itself_is_found(length, level):
    samples = quantised(noise(level=level))
    samples[5000 + length : 5000 + 2 * length] = samples[5000 : 5000 + length]
    result = check_repeats(samples, QUANTUM)
    assert result is not None and result.code == "repeated_block"
    assert f"{length} samples at {5000}" in result.problem


def test_half_a_buffer_a_quiet_block_and_a_periodic_sound_are_no_repeats():
    samples = quantised(noise())
    half = MIN_BUFFER // 2
    samples[5000 + half : 5000 + 2 * half] = samples[5000 : 5000 + half]
    assert check_repeats(samples, QUANTUM) is None
    quiet = quantised(noise(level=1e-6))
    assert check_repeats(quiet, QUANTUM) is None
    periodic = quantised(0.5 * np.sin(2 * np.pi * 441 * TIME_S))
    assert check_repeats(periodic, QUANTUM) is None


@pytest.mark.parametrize("count", [1000, RATE_HZ // 10])
def test_periodic_sound_that_ends_abruptly_is_no_repeat(count):
    """A burst without noise, digital silence, and the burst again."""
    burst = 0.5 * np.sin(2 * np.pi * 1000 * TIME_S[:count])
    silence = np.zeros(RATE_HZ // 10)
    for samples in (np.r_[burst, silence], np.r_[silence, burst, silence, burst, silence]):
        assert check_repeats(quantised(samples), QUANTUM) is None


def test_equal_sweeps_with_digital_silence_between_them_have_a_gap_and_no_repeat():
    samples = quantised(np.tile(np.r_[sweep()[:20_000], np.zeros(2000)], 2))
    assert check_repeats(samples, QUANTUM) is None
    assert check_gaps(samples, QUANTUM).code == "gap"


def test_a_block_that_follows_itself_next_to_digital_silence_is_found():
    samples = quantised(noise(count=8000))
    samples[5512:6024] = samples[5000:5512]
    for ends in (samples[:6024], samples[5000:]):
        padded = np.r_[np.zeros(2000, np.float32), ends, np.zeros(2000, np.float32)]
        assert "512 samples at" in check_repeats(padded, QUANTUM).problem


@pytest.mark.parametrize("count", [2, 3])
def test_a_block_that_follows_itself_several_times_is_found(count):
    samples = quantised(noise())
    samples[5000 : 5000 + count * 512] = np.tile(samples[5000:5512], count)
    assert "512 samples at 5000" in check_repeats(samples, QUANTUM).problem


@pytest.mark.parametrize("signal", [sweep, noise])
@pytest.mark.parametrize("bits", [8, 16, 24, 32])
@pytest.mark.parametrize("kind", ["<f4", "<f8"])
def test_bytes_of_floats_are_found_in_integers_of_any_width(signal, bits, kind):
    content = signal().astype(kind).tobytes()
    samples = integers(content, bits)
    assert check_encoding(samples, 0.5).code == "float_bytes"
    subtype = "PCM_U8" if bits == 8 else f"PCM_{bits}"
    codes = [remark.code for remark in check_samples(samples, subtype, 2048)]
    assert codes == ["float_bytes"]


def integers(content, bits):
    """Return bytes as samples of an integer file, full scale 1."""
    size = bits // 8
    octets = np.frombuffer(content[: len(content) // size * size], np.uint8).reshape(-1, size)
    if bits == 8:
        return (octets[:, 0] / 128 - 1).astype(np.float32)
    padded = np.zeros((len(octets), 4), np.uint8)
    padded[:, 4 - size :] = octets
    return (padded.view("<i4")[:, 0] / 2**31).astype(np.float32)


@pytest.mark.parametrize(
    "samples",
    [
        noise(level=0.3).clip(-1, 1),
        np.random.default_rng(1).uniform(-1, 1, RATE_HZ),
        0.5 * np.sin(2 * np.pi * RATE_HZ / 8 * TIME_S),
        0.49 * np.sign(np.sin(2 * np.pi * 300 * TIME_S)),
    ],
)
def test_loud_sound_is_no_float_bytes(samples):
    assert check_encoding(samples.astype(np.float32), 0.5) is None


OBJECTS = ["cube"] * 10 + ["ball"] * 10


@pytest.mark.parametrize(("factor", "count"), [(0.5, 0), (2, 5)])
def test_a_level_jump_is_found_whatever_the_levels_of_the_objects(factor, count):
    levels = np.r_[np.full(10, -20.0), np.full(10, -35.0)]
    levels += 0.2 * np.random.default_rng(1).normal(size=20)
    levels[[1, 5, 9, 12, 15]] -= factor * JUMP_DB
    jumps = level_jumps(levels, OBJECTS)
    assert np.count_nonzero(jumps) == count
    if count:
        assert np.flatnonzero(jumps).tolist() == [1, 5, 9, 12, 15]
        assert jumps[1] == pytest.approx(-2 * JUMP_DB, abs=1)


def test_a_jump_of_half_of_a_session_is_found():
    levels = np.tile(np.r_[np.full(5, -20.0), np.full(5, -40.0)], 2)
    levels += 0.2 * np.random.default_rng(1).normal(size=20)
    assert np.count_nonzero(level_jumps(levels, OBJECTS)) == 10


def test_levels_that_vary_widely_do_not_jump():
    levels = -30 + 4 * np.random.default_rng(2).normal(size=200)
    assert not level_jumps(levels, ["stone"] * 200).any()
    assert not level_jumps(np.array([-np.inf, -20, -20, -20]), ["a"] * 4).any()
    assert not level_jumps(np.array([-60.0, -20.0]), ["a", "a"]).any()
    assert not level_jumps(np.array([-40.0, -20.1, -20, -20.2]), [""] * 4).any()


@pytest.mark.parametrize(("factor", "swapped"), [(0.5, []), (2, [3, 7])])
def test_swapped_channels_are_those_with_the_rarer_order(factor, swapped):
    levels = np.tile([-20.0, -20.0 - factor * SWAP_DB], (10, 1))
    levels[[3, 7]] = levels[[3, 7], ::-1]
    assert np.flatnonzero(swapped_channels(levels)).tolist() == swapped


@pytest.mark.parametrize(("count", "is_found"), [(3, True), (4, False)])
def test_swapped_channels_need_a_usual_order(count, is_found):
    """Two thirds of ten recordings or more have it; it may be that of another contact, if not."""
    levels = np.tile([-20.0, -40.0], (10, 1))
    levels[:count] = levels[:count, ::-1]
    expected = np.arange(10) < count if is_found else np.zeros(10, bool)
    np.testing.assert_array_equal(swapped_channels(levels), expected)


@pytest.mark.parametrize("deviation_db", [3.5, 8])
def test_channels_whose_levels_vary_independently_are_not_swapped(deviation_db):
    """The difference has a standard deviation of 5 dB, that of hammer hits, or more."""
    for seed in range(5):
        levels = -30 + deviation_db * np.random.default_rng(seed).normal(size=(200, 2))
        assert not swapped_channels(levels).any()


def test_a_third_channel_and_silent_channels_do_not_matter():
    levels = np.tile([-20.0, -45.0, -60.0], (6, 1))
    levels[4] = [-20.0, -60.0, -45.0]
    assert np.flatnonzero(swapped_channels(levels)).tolist() == [4]
    silent = np.tile([-20.0, -np.inf], (6, 1))
    assert not swapped_channels(silent).any()


@pytest.mark.parametrize(
    ("band_hz", "codes"),
    [
        (None, ["hum"]),
        ((500, 20_000), []),  # 50, 100 and 150 Hz are excluded
        ((170, 20_000), ["hum"]),  # 150 Hz is in the neighbour of the lowest bin
        ((0, 60), ["offset", "hum"]),
    ],
)
def test_only_lines_that_reach_the_feature_are_hum(band_hz, codes):
    """The remedy of the message, another `features.band_hz`, ends the issue."""
    sound = sweep()
    lines = [np.sin(2 * np.pi * 50 * n * TIME_S + n) for n in (1, 2, 3)]
    samples = sound + 0.05 * np.sum(lines, axis=0)
    if "offset" in codes:
        samples += 0.1
    lines_hz = reaching_hz(band_hz, 2048, RATE_HZ)
    samples = samples.astype(np.float32)
    remarks = check_samples(samples, "PCM_16", 2048, sample_rate_hz=RATE_HZ, lines_hz=lines_hz)
    assert [remark.code for remark in remarks] == codes
