"""Filters, without `scipy.signal`: importing that takes as long as three scenes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.numba_cache import njit

Real = NDArray[np.floating]
#: Coefficients of s², s and 1.
Polynomial = tuple[float, float, float]
#: Numerator and denominator.
Section = tuple[Polynomial, Polynomial]


def bilinear(over: Polynomial, under: Polynomial, rate_hz: float) -> list[float]:
    """Return the digital section (6,) of an analogue one: s = 2 rate (1 - z⁻¹)/(1 + z⁻¹).

    b0, b1, b2, 1, a1, a2 of the powers of z⁻¹, as `filtered` takes them.

    >>> bilinear((0, 0, 1), (0, 1, 1), 0.5)  # 1/(s + 1)
    [0.5, 1.0, 0.5, 1.0, 1.0, 0.0]
    """
    k = 2 * rate_hz
    both = [
        (a * k**2 + b * k + c, 2 * (c - a * k**2), a * k**2 - b * k + c)
        for a, b, c in (over, under)
    ]
    return [value / both[1][0] for one in both for value in one]


@njit(nogil=True, cache=True)
def filtered(sections, samples):
    """Return `samples` (n,) through second-order `sections` (N, 6), as `scipy.signal.sosfilt`."""
    out = samples.copy()
    for s in range(len(sections)):
        b0, b1, b2, _, a1, a2 = sections[s]
        first = second = 0.0
        for n in range(len(out)):
            x = out[n]
            y = b0 * x + first
            first = b1 * x - a1 * y + second
            second = b2 * x - a2 * y
            out[n] = y
    return out


def kaiser_taps(stop_db: float, width: float) -> int:
    """Return how many taps hold `stop_db` beyond a transition of `width` times the rate.

    (A - 7.95)/(14.36 Δf) + 1 (Kaiser 1974; Oppenheim & Schafer, section 7.6), for A above 50 dB.
    """
    return int(np.ceil((stop_db - 7.95) / (2.285 * 2 * np.pi * width) + 1))


def kaiser_lowpass(half: int, cutoff: float, stop_db: float) -> Real:
    """Return a linear-phase low pass (2 half + 1,) of gain 1 at 0 Hz, 6 dB down at `cutoff` times
    the rate, for `stop_db` above 50 dB."""
    n = np.arange(-half, half + 1)
    taps = np.sinc(2 * cutoff * n) * np.kaiser(2 * half + 1, 0.1102 * (stop_db - 8.7))
    return taps / taps.sum()
