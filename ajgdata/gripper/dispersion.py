"""Undoing what the leapfrog's time step does to a response.

Marched in time, the staggered leapfrog turns s into (2/Δt) sinh(sΔt/2) wherever the equations
differentiate: a response at ω appears at ω' = (2/Δt) arcsin(ωΔt/2). That is known exactly, does not
depend on the medium, and is undone by reading the marched spectrum at ω' (time-dispersion
transform, Koene et al. 2018, Geophysical Journal International 213).

Exact this is for the leapfrog. What is averaged over a step, by the exponential drag and the
trapezoidal rule, keeps an error that is known as well: of the drag, of walls' resistances and of
relaxation times about (ωΔt)²/8 (1.6 % at 10 kHz with four steps a sample), of walls' masses twice
that, of the grains' density (γΔt)²/12 with γ the drag over the density, at all frequencies alike
(known_cases/time_step.py of the tests has the terms, and measures that nothing else is left).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.fft import fft, irfft, next_fast_len
from scipy.special import i0

from ajgdata.gripper.scene import SAMPLE_RATE_HZ

Real = NDArray[np.floating]
Complex = NDArray[np.complexfloating]
PASS_HZ = 20_000.0
#: Of the Kaiser-Bessel kernel on a twofold oversampled grid: errs by less than 1e-9.
TAPS = 12
SHAPE = 2.30 * TAPS


def undisperse(marched: Real, factor: int, latency: int) -> Real:
    """Samples (n // factor,) at 44.1 kHz of a response `marched` (n,) with `factor` steps a sample.

    `latency`, in samples, is that of the source pulse; it is kept. The source acts half a step
    before the pressure that is heard: that half step is taken out. The band ends smoothly between
    20 and 22.05 kHz.
    """
    count = len(marched) // factor
    length = next_fast_len(count + 4 * latency + 64, real=True)
    hertz = np.fft.rfftfreq(length, 1 / SAMPLE_RATE_HZ)
    step = 1 / (SAMPLE_RATE_HZ * factor)
    omega = 2 * np.pi * hertz
    warped = 2 * np.arcsin(omega * step / 2)
    delay = latency * factor
    spectrum = transform(marched, warped) * np.exp(
        1j * (warped * (delay - 0.5) - omega * step * delay)
    )
    edge = np.clip((hertz - PASS_HZ) / (SAMPLE_RATE_HZ / 2 - PASS_HZ), 0, 1)
    return irfft(spectrum * np.cos(np.pi / 2 * edge) ** 2, length)[:count] / factor


def transform(signal: Real, radians: Real) -> Complex:
    """Σ signal[n] e^{-i radians n}, (m,), of a signal (n,) at any angular frequencies (m,), per
    sample.

    Non-uniform fast Fourier transform with a Kaiser-Bessel kernel (Fessler & Sutton 2003).
    """
    count = len(signal)
    length = next_fast_len(2 * count)
    place = np.arange(count) - count // 2
    bend = np.sqrt(SHAPE**2 - (np.pi * TAPS * place / length) ** 2)
    spread = np.zeros(length)
    spread[place % length] = signal * bend / (TAPS * np.sinh(bend))
    grid = fft(spread)
    where = radians * length / (2 * np.pi)
    nearest = np.ceil(where - TAPS / 2).astype(np.int64)[:, None] + np.arange(TAPS)
    offset = (where[:, None] - nearest) / (TAPS / 2)
    weight = i0(SHAPE * np.sqrt(np.clip(1 - offset**2, 0, None)))
    return np.asarray(
        (weight * grid[nearest % length]).sum(1) * np.exp(-1j * radians * (count // 2))
    )
