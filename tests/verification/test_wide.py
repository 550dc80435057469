"""The wide scheme: dispersion of its stencil and of its time step."""

import numpy as np
import pytest

from ajgdata.gripper.scene import SAMPLE_RATE_HZ
from ajgdata.gripper.simulation import lowpass, undisperse
from ajgdata.gripper.solver_plan import ACCURATE_HZ, wide_weight


def test_waves_along_an_axis_are_right_where_the_weight_says():
    for h in (4.2e-3, 2e-3):
        w = wide_weight(h)
        half = np.pi * ACCURATE_HZ / 343.2 * h
        symbol = (1 + 3 * w) * np.sin(half) - w * np.sin(3 * half)
        # 343.2 m/s is the speed of sound at 20 °C, known to 0.1 m/s.
        assert symbol == pytest.approx(half, rel=1e-4)
    assert wide_weight(1e-4) == pytest.approx(1 / 24, rel=1e-3)


def _oscillator(hertz: float, factor: int, pulse: np.ndarray, steps: int) -> np.ndarray:
    """p' = q - ω² U, U' = p - 300 U, marched as the solver does."""
    dt = 1 / (SAMPLE_RATE_HZ * factor)
    omega = 2 * np.pi * hertz
    decay = np.exp(-300 * dt)
    p = u = 0.0
    out = np.empty(steps)
    drive = np.concatenate([pulse, np.zeros(steps - len(pulse))])
    for n in range(steps):
        u = decay * u + (1 - decay) / 300 * p
        p += dt * (drive[n] * SAMPLE_RATE_HZ - omega**2 * u)
        out[n] = p
    return out


@pytest.mark.parametrize("hertz", [900.0, 11_000.0])
def test_the_dispersion_of_the_time_step_is_undone(hertz):
    """An oscillator marched with a coarse step sounds like one marched with steps 16 times finer,
    and without the correction it does not."""
    sounds = {}
    for factor in (4, 64):
        pulse, latency = lowpass(factor)
        marched = _oscillator(hertz, factor, pulse, 2_000 * factor)
        late = undisperse(marched, factor, latency)
        sounds[factor] = late[latency:][:1_500], marched[latency * factor :: factor][:1_500]
    (right, plain) = sounds[4]
    (fine, _) = sounds[64]
    size = np.linalg.norm(fine)
    # What is left is the loss, which is damped as at ω' (1 + (ωΔt)²/8) and not at ω.
    step = 2 * np.pi * hertz / (4 * SAMPLE_RATE_HZ)
    assert np.linalg.norm(right - fine) < max(step**2 / 8, 2e-3) * size
    if hertz > 5_000:
        assert np.linalg.norm(plain - fine) > 0.5 * size
