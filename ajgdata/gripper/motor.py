"""Sound of the servo that holds the gripper at an angle.

A model of ours: nothing is published of such sounds, and every arm has its own. A servo that holds
a joint hums at harmonics of its control frequency, through the structure rather than the air. How
loud each harmonic is depends on where the rotor rests among the poles and gear teeth; here the k-th
of them, 1 / k at the middle, goes up and down k times over a turn of the joint. So a neighbouring
angle sounds alike, and no two angles of a turn sound the same.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.external_noise import REFERENCE_PA
from ajgdata.gripper.scene import SAMPLE_RATE_HZ
from ajgdata.gripper.signal_settings import Motor

Real = NDArray[np.floating]


def harmonic_amplitudes(motor: Motor, angle_deg: float) -> Real:
    """Amplitudes (Pa) of the harmonics at the microphone, (harmonics,).

    a_k = A (1 + d cos(k θ + k²)) / k: the phases k² keep the harmonics from rising together. The
    mean power over all angles, A² Σ (1 + d² / 2) / (2 k²), is that of the motor's level.
    """
    k = np.arange(1, motor.harmonics + 1)
    power = np.sum((1 + motor.depth**2 / 2) / (2 * k**2))
    middle = REFERENCE_PA * 10 ** (motor.level_db_spl / 20) / np.sqrt(power)
    turn = 1 + motor.depth * np.cos(k * np.deg2rad(angle_deg) + k**2)
    return np.asarray(middle * turn / k)


def motor_sound(count: int, motor: Motor, angle_deg: float, seed: int) -> Real:
    """Pressure (Pa) at the microphone, (count,): a sum of sines whose phases `seed` draws, and
    whose fundamental it draws within the motor's drift."""
    generator = np.random.default_rng(seed)
    amplitude = harmonic_amplitudes(motor, angle_deg)
    fundamental = motor.fundamental_hz * (1 + motor.drift * generator.uniform(-1, 1))
    phase = generator.uniform(0, 2 * np.pi, motor.harmonics)
    k = np.arange(1, motor.harmonics + 1)
    time = np.arange(count) / SAMPLE_RATE_HZ
    turns = 2 * np.pi * fundamental * np.outer(time, k) + phase
    return np.asarray(np.sin(turns) @ amplitude)
