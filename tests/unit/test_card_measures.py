"""Measures of a sound card against answers known beforehand."""

import numpy as np
import pytest
from scipy.signal import iirpeak, lfilter, resample_poly

from ajgdata.acquire.card_measures import (
    Pulses,
    band_powers,
    clock_drift,
    dbfs,
    harmonic_distortion,
    hum,
    pulse_delays,
    sweep_powers,
)
from ajgdata.acquire.markers import framed
from ajgdata.features.bands import third_octaves
from ajgdata.gripper import excitation_sweep

RATE_HZ = 44_100
LOW_HZ, HIGH_HZ = 20.0, 20_000.0
SWEEP = excitation_sweep(amplitude=0.5)
CENTRES = third_octaves()
RNG = np.random.default_rng(0)
TIME = np.arange(2 * RATE_HZ) / RATE_HZ
NOTHING = np.zeros(2 * RATE_HZ)


def test_third_octaves_are_those_of_the_standard():
    assert len(CENTRES) == 29 and CENTRES[0] == pytest.approx(25.12, abs=0.01)
    assert CENTRES[-1] == pytest.approx(15_849, abs=1)
    np.testing.assert_allclose(CENTRES[10:] / CENTRES[:-10], 10)


def test_levels_of_a_sine_and_of_white_noise():
    tone = np.sin(2 * np.pi * 1_000 * TIME)
    powers = band_powers(tone, RATE_HZ, CENTRES)
    assert dbfs(powers[16]) == pytest.approx(0, abs=1e-6) and powers.sum() == pytest.approx(0.5)
    noise = 0.01 * RNG.standard_normal(len(TIME))
    widths = CENTRES * (10**0.05 - 10**-0.05)
    expected = 1e-4 * widths / (RATE_HZ / 2)
    # A band of B = width times two seconds bins has a relative error of 1/sqrt(B): five of them.
    error = np.abs(band_powers(noise, RATE_HZ, CENTRES) / expected - 1)
    assert np.all(error < 5 / np.sqrt(2 * widths))


def test_signal_to_noise_of_a_flat_card():
    """A sine of 0.5 is there while the sweep is in a band: -6 dBFS, wherever that is."""
    octaves = np.log2(HIGH_HZ / LOW_HZ)
    inner = CENTRES[(CENTRES > 50) & (CENTRES < 16_000)]
    level = dbfs(sweep_powers(SWEEP, np.zeros(RATE_HZ), RATE_HZ, inner, 1.0, octaves)[0])
    np.testing.assert_allclose(level, 20 * np.log10(0.5), atol=0.25)


def test_noise_alone_is_no_signal():
    """Noise is heard for as long as the take lasts, not only while the sweep is in a band: without
    its share taken off it would stand 15 dB above itself."""
    octaves, runs = np.log2(HIGH_HZ / LOW_HZ), []
    for _ in range(10):
        heard, silence = RNG.standard_normal((2, 2 * RATE_HZ))
        powers = sweep_powers(heard[:48_510], silence, RATE_HZ, CENTRES, 1.0, octaves)
        runs.append(dbfs(powers[0]) - dbfs(powers[1]))
    # 2.6 bands of 290 are expected to exceed three deviations; a Poisson count passes 10 in 10^5.
    assert np.count_nonzero(np.array(runs)) <= 10
    np.testing.assert_array_equal(np.median(runs, axis=1), 0)


@pytest.mark.parametrize("snr_db", [15, 30])
def test_signal_to_noise_is_what_it_is(snr_db):
    """Noise of known density. A band's power varies by 1/sqrt(B 1.1 s), 1.1/0.033 times as much
    against that of the sweep's 33 ms: at 15 dB and 1 kHz by 0.07 of it."""
    octaves, inner = np.log2(HIGH_HZ / LOW_HZ), CENTRES[(CENTRES > 950) & (CENTRES < 16_000)]
    heard, silence = np.zeros(48_510), RNG.standard_normal(2 * RATE_HZ)
    heard[: len(SWEEP)] = SWEEP
    density = 10 ** (-snr_db / 10) / 8 / (1_000 * (10**0.05 - 10**-0.05))  # of 1 kHz: 0.5² / 2
    scale = np.sqrt(density * RATE_HZ / 2)
    heard += scale * RNG.standard_normal(len(heard))
    sweep, noise = sweep_powers(heard, scale * silence, RATE_HZ, inner, 1.0, octaves)
    expected = snr_db - 10 * np.log10(inner / 1_000)
    clear = expected > 10
    np.testing.assert_allclose((dbfs(sweep) - dbfs(noise))[clear], expected[clear], atol=1.2)


@pytest.mark.parametrize("mains_hz", [50, 60])
def test_hum_of_known_level(mains_hz):
    silence = 1e-4 * RNG.standard_normal(len(TIME))
    lines = [(1, 2e-3), (3, 1e-3)]
    for k, amplitude in lines:
        silence += amplitude * np.sin(2 * np.pi * k * mains_hz * TIME + k)
    found = {mains: hum(silence, RATE_HZ, mains) for mains in (50, 60)}
    expected = 10 * np.log10(sum(a**2 for _, a in lines))
    assert found[mains_hz].level_dbfs == pytest.approx(expected, abs=0.1)
    assert found[mains_hz].prominence_db > 25
    assert found[110 - mains_hz].prominence_db < 6


def test_noise_alone_does_not_hum():
    worst = max(hum(RNG.standard_normal(len(TIME)), RATE_HZ, 50).prominence_db for _ in range(30))
    assert worst < 3
    with pytest.raises(ValueError, match="a second of silence"):
        hum(np.zeros(100), RATE_HZ, 50)


@pytest.mark.parametrize("second, third", [(0.02, 0.0), (0.0, 0.03), (0.01, 0.01)])
def test_known_distortion(second, third):
    """x + a x² + b x³ of a sine A: harmonics a A²/2 and b A³/4, fundamental A + 3 b A³/4."""
    a, b, amplitude = second / 0.25, third / 0.0625, 0.5
    heard = SWEEP + a * SWEEP**2 + b * SWEEP**3
    fundamental = amplitude + 0.75 * b * amplitude**3
    parts = a * amplitude**2 / 2 / fundamental, b * amplitude**3 / 4 / fundamental
    found = harmonic_distortion(
        np.r_[heard, np.zeros(4_000)], SWEEP, NOTHING, RATE_HZ, LOW_HZ, HIGH_HZ
    )
    # A window of 28 ms resolves 36 Hz: a third octave (23 % of its centre) is wider from 155 Hz on.
    for low_hz, tolerance in ((155, 0.12), (400, 0.03)):
        middle = (found.centres_hz > low_hz) & (found.centres_hz < 5_000)
        np.testing.assert_allclose(found.ratio[middle], np.hypot(*parts), rtol=tolerance)


def test_resonances_of_the_gripper_are_no_distortion():
    """What the speaker adds is the same behind a resonance that makes the harmonic ten times as
    loud as the fundamental: here 4 kHz, the second harmonic of 2 kHz."""
    resonance = lfilter(*iirpeak(4_000, 10, fs=RATE_HZ), np.r_[1, np.zeros(4_000)])
    resonance[0] += 0.1
    distorted = SWEEP + 0.02 / 0.25 * SWEEP**2
    heard = np.convolve(distorted, resonance)
    found = harmonic_distortion(heard, SWEEP, NOTHING, RATE_HZ, LOW_HZ, HIGH_HZ)
    at = int(np.argmin(np.abs(found.centres_hz - 1_995)))
    assert found.ratio[at] == pytest.approx(0.02, rel=0.1)


def test_a_linear_card_is_not_called_distorted():
    found = harmonic_distortion(
        np.r_[SWEEP, np.zeros(4_000)], SWEEP, NOTHING, RATE_HZ, LOW_HZ, HIGH_HZ
    )
    assert found.ratio[found.centres_hz > 155].max() < 2e-3


def test_noise_is_told_from_distortion():
    """Noise of the sweep's length is in both alike: within a factor of two in the mean."""
    noisy = np.r_[SWEEP, np.zeros(4_000)]
    noisy = noisy + 0.01 * RNG.standard_normal(len(noisy))
    silence = 0.01 * RNG.standard_normal(2 * RATE_HZ)
    found = harmonic_distortion(noisy, SWEEP, silence, RATE_HZ, LOW_HZ, HIGH_HZ)
    middle = (found.centres_hz > 150) & (found.centres_hz < 5_000)
    assert 0.5 < np.median(found.ratio[middle] / found.noise[middle]) < 2


def fourier(shape, amplitude: float) -> float:
    """Harmonics 2 to 5 against the fundamental of a sine through `shape`, by its Fourier series."""
    lines = np.abs(np.fft.rfft(shape(amplitude * np.sin(2 * np.pi * np.arange(4_096) / 4_096))))
    return float(np.sqrt(np.sum(lines[2:6] ** 2)) / lines[1])


@pytest.mark.parametrize(
    "shape",
    [
        lambda x: np.clip(x, -0.05, 0.05),  # all odd harmonics, to the last: 38 %
        lambda x: np.tanh(20 * x),
        lambda x: np.clip(x, -0.45, 0.45),
    ],
)
def test_strong_clipping_is_not_taken_for_noise(shape):
    """Its odd harmonics go on for ever, wherever in the response one would look for noise."""
    noise = 1e-5 * RNG.standard_normal((2, 2 * RATE_HZ))
    heard = noise[0, :48_510]
    heard[: len(SWEEP)] += shape(SWEEP)
    found = harmonic_distortion(heard, SWEEP, noise[1], RATE_HZ, LOW_HZ, HIGH_HZ)
    middle = (found.centres_hz > 155) & (found.centres_hz < 3_500)
    np.testing.assert_allclose(found.ratio[middle], fourier(shape, 0.5), rtol=0.15)
    assert np.all(found.ratio[middle] > 5 * found.noise[middle])


def test_distortion_needs_a_silence_that_the_sweep_passes_over():
    with pytest.raises(ValueError, match="a silence that is longer than the sweep"):
        harmonic_distortion(SWEEP, SWEEP, np.zeros(len(SWEEP)), RATE_HZ, LOW_HZ, HIGH_HZ)


@pytest.mark.parametrize("ppm", [0, 100, -200])
def test_known_drift(ppm):
    """A recording clock that is fast takes more samples of the same pulses."""
    every, count = RATE_HZ // 2, 8
    up = 10_000
    played = pulses(every, count)
    heard = played if not ppm else resample_poly(played, up + ppm // 100, up)
    found = clock_drift(delays(heard, every, count), every)
    expected = 1e6 * ((up + ppm // 100) / up - 1)
    assert found.ppm == pytest.approx(expected, abs=0.5) and found.lost_frames == 0
    assert found.error_ppm < 0.5


PULSE = framed(SWEEP, RATE_HZ).marker


def pulses(every: int, count: int) -> np.ndarray:
    one = np.zeros(every)
    one[: len(PULSE)] = PULSE
    return np.tile(one, count)


def delays(heard: np.ndarray, every: int, count: int) -> Pulses:
    return pulse_delays(np.r_[heard, np.zeros(200)], PULSE, every, count, reach=every // 8)


@pytest.mark.parametrize("snr_db", [40, 20, 10, 0])
def test_noise_is_neither_lost_frames_nor_a_second_clock(snr_db):
    """Nothing is lost: either that is what is found, or too little was heard to tell."""
    every, count = RATE_HZ, 20
    rms = np.sqrt(np.mean(SWEEP**2))
    for _ in range(3):
        noise = rms * 10 ** (-snr_db / 20) * RNG.standard_normal(every * count)
        found = clock_drift(delays(pulses(every, count) + noise, every, count), every)
        assert found.lost_frames == 0 and abs(found.ppm) < 5 * found.error_ppm < 1


def test_pulses_that_drown_are_not_compared():
    every, count = RATE_HZ, 8
    drowned = delays(pulses(every, count) + 3 * RNG.standard_normal(every * count), every, count)
    assert drowned.likeness[1:].max() < 0.4 and clock_drift(drowned, every) is None
    heard = pulses(every, count)
    heard[3 * every : 4 * every] = 0.1 * RNG.standard_normal(every)  # one is missing
    heard = np.r_[heard[: 5 * every + 9_000], heard[5 * every + 9_007 :]]  # later seven frames are
    some = delays(heard, every, count)
    assert np.flatnonzero(~some.heard).tolist() == [3]
    found = clock_drift(some, every)
    assert found.lost_frames == 7 and abs(found.ppm) < 0.1
