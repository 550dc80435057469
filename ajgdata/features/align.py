"""Alignment: the delay of the excitation in a recording, and delays that stand out.

The delay is the peak of a generalised cross-correlation (C. Knapp and G. Carter, IEEE Trans. ASSP
24, 1976) in which the recording counts with its phase alone, so that neither low-frequency noise
nor a strong resonance decides. Before that, the recording is limited to five times its median
amplitude, so that a knock does not decide either.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import ArrayLike, NDArray

_LIMIT = 5.0  # times the median amplitude; a sweep alone stays below 1.5 times
_SPREAD = 5.0  # standard deviations: one false alarm in two million for a normal distribution
_TOLERANCE_S = 0.005  # a buffer's length; less than this is never called an outlier


def delay_samples(recording: NDArray[Any], excitation: NDArray[Any], max_delay: int) -> int:
    """Return samples by which `excitation` (m,) arrives late in `recording` (n,); negative when
    early.

    Only delays up to +-`max_delay` are considered. Raises ValueError when either is silent, not
    finite, or not one-dimensional.

    >>> import numpy as np
    >>> from ajgdata.features.align import delay_samples
    >>> played = np.random.default_rng(0).standard_normal(1000)
    >>> heard = np.concatenate([np.zeros(30), 0.2 * played])
    >>> delay_samples(heard, played, max_delay=100)
    30
    """
    played = _prepared(excitation, "excitation")
    heard = _prepared(recording, "recording")
    if limit := _LIMIT * float(np.median(np.abs(heard))):
        heard = heard.clip(-limit, limit)
    length = scipy.fft.next_fast_len(len(heard) + len(played) - 1, real=True)
    sound = scipy.fft.rfft(heard, length)
    strength = np.abs(sound)
    phase = sound / np.maximum(strength, 1e-12 * strength.max())
    correlation = np.abs(scipy.fft.irfft(phase * scipy.fft.rfft(played, length).conj(), length))
    reach = min(max_delay, len(heard) - 1), min(max_delay, len(played) - 1)
    delays = np.arange(-reach[1], reach[0] + 1)
    return int(delays[np.argmax(correlation[delays])])


def shift(samples: NDArray[Any], delay: int) -> NDArray[Any]:
    """Take a delay out: sample i of the result (n,) is sample i + delay, or 0 beyond the ends."""
    shifted = np.zeros_like(samples)
    kept = len(samples) - abs(delay)
    if kept > 0:
        to, start = max(-delay, 0), max(delay, 0)
        shifted[to : to + kept] = samples[start : start + kept]
    return shifted


def delay_outliers(delays: ArrayLike, sample_rate_hz: float) -> NDArray[np.bool_]:
    """Return True for each delay (n,), in samples, that does not belong to the others of its
    session.

    Those further from the median than five robust standard deviations (1.4826 times the median
    absolute deviation) and than 5 ms: in one session sound card and geometry stay the same.
    """
    values = np.asarray(delays, dtype=np.float64)
    if not values.size:
        return np.zeros(0, dtype=np.bool_)
    distance = np.abs(values - np.median(values))
    spread = 1.4826 * float(np.median(distance))
    return distance > max(_SPREAD * spread, _TOLERANCE_S * sample_rate_hz)


def _prepared(samples: NDArray[Any], name: str) -> NDArray[np.float64]:
    """Return samples without their mean and scaled to peak 1, in float64."""
    signal = np.asarray(samples, dtype=np.float64)
    if signal.ndim != 1 or not signal.size:
        raise ValueError(f"the {name} must have shape (n,) with n > 0, got {signal.shape}")
    peak = float(np.abs(signal).max())
    if not (0 < peak < np.inf):
        raise ValueError(f"the {name} is silent or not finite: run the checks first")
    signal = signal / peak
    return signal - signal.mean()
