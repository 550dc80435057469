"""Every kind of excitation has the properties that its formula promises; the default is the sweep
that all data sets so far were recorded with."""

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError
from scipy.signal import hilbert

from ajgdata.acquire.excitation import excitation_samples
from ajgdata.gripper import SAMPLE_RATE_HZ, excitation_sweep
from ajgdata.types import (
    DEFAULT_EXCITATION,
    ExcitationSpec,
    LogSweep,
    MaximumLengthSequence,
)

RATE = SAMPLE_RATE_HZ
KINDS = (LogSweep, MaximumLengthSequence)
LENGTHS = (0.1, 1.0)


def test_the_default_is_the_sweep_that_the_virtual_gripper_has_always_played():
    assert excitation_samples(DEFAULT_EXCITATION, RATE).tobytes() == excitation_sweep().tobytes()


def crest_factor_db(samples: np.ndarray) -> float:
    """Peak over rms of samples (n,) in decibels."""
    return float(20 * np.log10(np.abs(samples).max() / np.sqrt(np.mean(np.square(samples)))))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("length_s", LENGTHS)
def test_length_level_and_determinism(kind, length_s):
    declared = kind(length_s=length_s, amplitude=0.25, silence_s=0.05)
    samples = excitation_samples(declared, RATE)
    sounding = round(length_s * RATE)
    assert samples.shape == (sounding + 2205,)
    assert not samples[sounding:].any()
    # A sweep goes through every phase: some sample is within 0.14 rad of a crest, cos(0.14) = 0.99.
    assert 0.99 * 0.25 <= np.abs(samples).max() <= 0.25 * (1 + 1e-12)
    excitation_samples.cache_clear()
    assert excitation_samples(declared, RATE).tobytes() == samples.tobytes()
    assert f"{length_s:g} s" in declared.description and "-12.04 dBFS" in declared.description


def frequency_at(samples: np.ndarray, time_s: float) -> float:
    """Instantaneous frequency: the slope of the analytic signal's phase over 2 ms."""
    at = round(time_s * RATE)
    phase = np.unwrap(np.angle(hilbert(samples)))[at - 44 : at + 45]
    return float(np.polyfit(np.arange(-44, 45) / RATE, phase, 1)[0] / (2 * np.pi))


@pytest.mark.parametrize("share", [0.4, 0.9])
def test_instantaneous_frequency_of_the_sweep(share):
    """f = low (high/low)^(t/T). Over 2 ms it bends by (0.001 ln(1000))^2/6 of itself, 8e-6; the
    Hilbert transform of a faded sweep is good to 1e-3."""
    samples = excitation_samples(LogSweep(), RATE)
    assert frequency_at(samples, share) == pytest.approx(20 * 1000**share, rel=3e-3)


def test_energy_of_the_sweep_falls_by_3_db_an_octave():
    """|X(f)|² = A² T/(4 ln(high/low) f) by stationary phase."""
    frequency = np.fft.rfftfreq(RATE, 1 / RATE)
    power = np.abs(np.fft.rfft(excitation_samples(LogSweep(), RATE)) / RATE) ** 2
    for low in (400, 1600, 6400):
        inside = (frequency >= low) & (frequency < 2 * low)
        expected = (0.81 / (4 * np.log(1000) * frequency[inside])).sum()
        assert power[inside].sum() == pytest.approx(expected, rel=0.02)  # ripple, over octaves


def test_fades_are_raised_cosines():
    plain = excitation_samples(LogSweep(fade_s=0), RATE)
    faded = excitation_samples(LogSweep(fade_s=0.01), RATE)
    time = np.arange(441) / RATE
    edge = np.sin(np.pi / 2 * time / 0.01) ** 2
    assert np.allclose(faded[:441], plain[:441] * edge, atol=1e-15)
    assert np.allclose(faded[-441:], plain[-441:] * edge[::-1], atol=1e-15)
    assert np.array_equal(faded[441:-441], plain[441:-441])


def test_autocorrelation_of_the_sequence_is_one_and_minus_one_nth():
    count = 2**12 - 1
    declared = MaximumLengthSequence(order=12, amplitude=1, length_s=count / RATE)
    samples = excitation_samples(declared, RATE)
    assert samples.shape == (count,) and set(np.unique(samples)) == {-1, 1}
    circular = np.fft.irfft(np.abs(np.fft.rfft(samples)) ** 2, count) / count
    assert circular[0] == pytest.approx(1)
    assert np.allclose(circular[1:], -1 / count, atol=1e-12)
    assert crest_factor_db(samples) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"kind": "log_sweep", "low_hz": 500, "high_hz": 400}, "low_hz 500 must be below"),
        ({"kind": "log_sweep", "length_s": 0.1, "fade_s": 0.06}, "two fades do not fit"),
    ],
)
def test_what_cannot_be_played_is_refused(given, said):
    with pytest.raises(ValidationError, match=said):
        TypeAdapter(ExcitationSpec).validate_python(given)
    with pytest.raises(ValueError, match="high_hz 20000 is not below half the rate of 16000 Hz"):
        excitation_samples(LogSweep(), 16_000)
