"""The sound of the motor: its level, its harmonics, and what of the angle it tells."""

import math

import numpy as np
import pytest

from ajgdata.gripper.noise import harmonic_amplitudes, motor_sound
from ajgdata.gripper.signal_chain import ImpulseResponse, excitation_sweep, record
from ajgdata.gripper.signal_settings import Motor, SignalChain

MOTOR = Motor()
STILL = ImpulseResponse(np.array([1.0]), 0.0, 44_100, 0, {})
SILENT = SignalChain(level_db_spl=None, noise_db_spl=None)
SWEEP = excitation_sweep()


def test_the_mean_power_over_a_turn_is_that_of_the_level():
    """Cosines of whole turns average out exactly over equidistant angles, more than harmonics."""
    angles = np.arange(0, 360, 10)
    power = [np.sum(harmonic_amplitudes(MOTOR, angle) ** 2) / 2 for angle in angles]
    level = 10 * np.log10(np.mean(power)) - 20 * np.log10(20e-6)
    assert level == pytest.approx(MOTOR.level_db_spl, abs=1e-9)


def test_a_recording_of_the_motor_alone_holds_its_harmonics_at_their_level():
    """Without drift 420 Hz is a whole number of periods of one second: each falls into one bin."""
    motor = MOTOR.model_copy(update={"drift": 0.0})
    spectrum = np.fft.rfft(motor_sound(44_100, motor, 27.0, seed=3)) / 22_050
    amplitude = np.abs(spectrum)
    harmonics = amplitude[420 * np.arange(1, 9)]
    np.testing.assert_allclose(harmonics, harmonic_amplitudes(motor, 27.0), rtol=1e-9)
    assert np.delete(amplitude, 420 * np.arange(1, 9)).max() < 1e-9 * harmonics.max()


def test_a_chain_with_a_motor_adds_it_to_all_else():
    """To two quantisation steps of 2^-24: each recording is rounded by at most half a code."""
    quiet = SignalChain(noise_db_spl=None)
    with_motor = {"motor": MOTOR}
    plain = record(STILL, SWEEP, quiet, 5).samples
    both = record(STILL, SWEEP, quiet.model_copy(update=with_motor), 5, 27.0).samples
    alone = record(STILL, SWEEP, SILENT.model_copy(update=with_motor), 5, 27.0).samples
    np.testing.assert_allclose(both, plain + alone, atol=1.5 * 2.0**-23)
    assert np.abs(alone).max() > 100 * 2.0**-23
    np.testing.assert_array_equal(record(STILL, SWEEP, quiet, 5, 27.0).samples, plain)


def test_harmonics_by_hand():
    """a_k is proportional to (1 + d cos(k θ + k²)) / k: at 0° the cosines are those of 1, 4 and 9;
    a quarter turn later they are -sin 1, -cos 4 and sin 9."""
    motor = MOTOR.model_copy(update={"harmonics": 3, "depth": 0.6})
    for angle, cosines in (
        (0.0, (math.cos(1), math.cos(4), math.cos(9))),
        (90.0, (-math.sin(1), -math.cos(4), math.sin(9))),
    ):
        amplitudes = harmonic_amplitudes(motor, angle)
        expected = [(1 + 0.6 * cosine) / k for k, cosine in enumerate(cosines, start=1)]
        np.testing.assert_allclose(amplitudes / amplitudes[0], np.array(expected) / expected[0])
