"""Noise at the microphone: sound from outside, and the servo that holds the gripper at an angle.

`ajgdata.gripper.outside` computes the part of the outside sound that enters. The servo is our own
model, because no measurement is published. It emits harmonics of its control frequency. The k-th
harmonic has the mean amplitude 1 / k and varies k times over a turn of the joint. The sound is
therefore similar at neighbouring angles, and differs between all angles of a turn.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.scene import SAMPLE_RATE_HZ
from ajgdata.gripper.signal_settings import Motor

Real = NDArray[np.floating]
#: Sound pressure (rms) of 0 dB.
REFERENCE_PA = 20e-6
#: Band of the sound outside, whose spectrum is white in it.
OUTSIDE_BAND_HZ = (20.0, 20_000.0)


def a_weighting(frequency_hz: Real) -> Real:
    """Return the gain of A-weighting at frequencies, of their shape: a factor, 1 at 1 kHz.

    It is the analytic form of IEC 61672-1:2013, annex E.
    """
    square = np.square(frequency_hz, dtype=np.float64)
    poles = np.array([20.598997, 107.65265, 737.86223, 12194.217]) ** 2

    def gain(f2: Real | float) -> Real:
        outer = (f2 + poles[0]) * (f2 + poles[3])
        return np.asarray(poles[3] * f2**2 / (outer * np.sqrt((f2 + poles[1]) * (f2 + poles[2]))))

    return gain(square) / gain(1e6)


def external_noise_pa(count: int, gain: Real, dba: float, coupling_hz: float, seed: int) -> Real:
    """Return the pressure (Pa) at the microphone, (count,), of white sound of `dba` dB(A) outside.

    It is Gaussian noise, filtered in the frequency domain by the AC coupling and by `gain` (n,) at
    equally spaced frequencies from 0 to half the rate. Sounds of one `seed` and of different levels
    differ only by a factor.
    """
    white = np.random.default_rng(seed).standard_normal(count)
    frequency_hz = np.fft.rfftfreq(count, 1 / SAMPLE_RATE_HZ)
    gain_hz = np.linspace(0, SAMPLE_RATE_HZ / 2, len(gain))
    entering = np.sqrt(np.interp(frequency_hz, gain_hz, gain**2))
    response = entering * _outside_response(count, coupling_hz)
    filtered = np.fft.irfft(np.fft.rfft(white) * response, count)
    return REFERENCE_PA * 10 ** (dba / 20) * filtered


@lru_cache(maxsize=16)
def _outside_response(count: int, coupling_hz: float) -> Real:
    """Return the response (count // 2 + 1,) from unit white noise to outside sound of 0 dB(A).

    The unit is the reference pressure, and the AC coupling is included.
    """
    low, high = OUTSIDE_BAND_HZ
    fine = np.linspace(low, high, 200_001)
    density = 1 / np.trapezoid(a_weighting(fine) ** 2, fine)
    frequency_hz = np.fft.rfftfreq(count, 1 / SAMPLE_RATE_HZ)
    in_band = (frequency_hz >= low) & (frequency_hz <= high)
    # Unit white noise has the one-sided density 2 / rate.
    amplitude = np.sqrt(density * SAMPLE_RATE_HZ / 2)
    return amplitude * in_band * frequency_hz / np.hypot(frequency_hz, coupling_hz)


def harmonic_amplitudes(motor: Motor, angle_deg: float) -> Real:
    """Return the amplitudes (Pa) of the harmonics at the microphone, (harmonics,).

    a_k = A (1 + d cos(k θ + k²)) / k. Because of the phases k², the maxima of the harmonics are at
    different angles. The mean power over all angles, A² Σ (1 + d² / 2) / (2 k²), is that of the
    motor's level.
    """
    k = np.arange(1, motor.harmonics + 1)
    power = np.sum((1 + motor.depth**2 / 2) / (2 * k**2))
    middle = REFERENCE_PA * 10 ** (motor.level_db_spl / 20) / np.sqrt(power)
    modulation = 1 + motor.depth * np.cos(k * np.deg2rad(angle_deg) + k**2)
    return np.asarray(middle * modulation / k)


def motor_sound(count: int, motor: Motor, angle_deg: float, seed: int) -> Real:
    """Return the pressure (Pa) at the microphone, (count,): a sum of sines.

    `seed` determines their phases, and their fundamental within the motor's drift.
    """
    generator = np.random.default_rng(seed)
    amplitude = harmonic_amplitudes(motor, angle_deg)
    fundamental = motor.fundamental_hz * (1 + motor.drift * generator.uniform(-1, 1))
    phase = generator.uniform(0, 2 * np.pi, motor.harmonics)
    k = np.arange(1, motor.harmonics + 1)
    time = np.arange(count) / SAMPLE_RATE_HZ
    phases = 2 * np.pi * fundamental * np.outer(time, k) + phase
    return np.asarray(np.sin(phases) @ amplitude)
