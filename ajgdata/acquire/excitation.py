"""Played samples of a declared excitation. Equal declarations give equal samples.

Samples are float64 in [-1, 1] of full scale; a sound card gets them as float32. Fades are raised
cosines: sin²(π t / 2 T), where t is the time to the nearer end and T the length of the fade.

A logarithmic sweep has an energy density that falls by 3 dB per octave. The density of a linear
sweep and of a maximum-length sequence is flat. At equal peak level the crest factor (peak over rms)
gives the played energy: 3 dB for sweeps (a sine's), 0 dB for the sequence.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import max_len_seq

from ajgdata.types import ExcitationSpec, LogSweep, MaximumLengthSequence

Real = NDArray[np.float64]


@lru_cache(maxsize=32)
def excitation_samples(declared: ExcitationSpec, sample_rate_hz: int) -> Real:
    """Return the samples (n,) of an excitation, n = (length_s + silence_s) rate.

    The array is read-only. Raises ValueError for a band that reaches beyond half the rate, and for
    a sound shorter than two samples.

    >>> from ajgdata.acquire.excitation import excitation_samples
    >>> from ajgdata.types import LogSweep
    >>> samples = excitation_samples(LogSweep(length_s=0.5, amplitude=0.9), 44_100)
    >>> samples.shape, bool(abs(samples).max() <= 0.9)
    ((22050,), True)
    """
    high = getattr(declared, "high_hz", 0.0)
    if high >= sample_rate_hz / 2:
        raise ValueError(
            f"excitation.high_hz {high:g} is not below half the rate of {sample_rate_hz} Hz"
        )
    count = round(declared.length_s * sample_rate_hz)
    if count < 2:
        raise ValueError(f"excitation.length_s {declared.length_s:g} is shorter than two samples")
    sound = _MAKERS[declared.kind](declared, count, sample_rate_hz)
    silence = np.zeros(round(declared.silence_s * sample_rate_hz))
    samples = np.concatenate([sound, silence])
    samples.flags.writeable = False
    return samples


def _faded(unit: Real, declared: Any, sample_rate_hz: int) -> Real:
    """Return a sound `unit` (n,) of peak 1 with its declared level and fades."""
    if not declared.fade_s:
        return np.asarray(declared.amplitude * unit)
    time = np.arange(len(unit)) / sample_rate_hz
    edge = np.clip(np.minimum(time, time[::-1]) / declared.fade_s, 0, 1)
    return np.asarray(declared.amplitude * unit * np.sin(np.pi / 2 * edge) ** 2)


def _log_sweep(declared: LogSweep, count: int, rate: int) -> Real:
    """Return a sweep with f(t) = low (high/low)^(t/T), phase 2π low T/ln(high/low) (f(t)/low - 1).

    A. Farina, "Simultaneous measurement of impulse response and distortion with a swept-sine
    technique", 108th AES Convention (2000), equation 7.
    """
    time = np.arange(count) / rate
    log_ratio = np.log(declared.high_hz / declared.low_hz)
    scale = 2 * np.pi * declared.low_hz * declared.length_s / log_ratio
    phase = scale * np.expm1(time / declared.length_s * log_ratio)
    return _faded(np.sin(phase), declared, rate)


def _sequence(declared: MaximumLengthSequence, count: int, rate: int) -> Real:
    """Return a sequence of ±1. Its circular autocorrelation is N at 0, else -1, N = 2^order - 1.

    D. Rife and J. Vanderkooy, "Transfer-function measurement with maximum-length sequences",
    J. Audio Eng. Soc. 37 (1989).
    """
    order = declared.order or max(2, (count + 1).bit_length() - 1)
    bits = max_len_seq(order)[0].astype(np.float64)
    return _faded(np.resize(2 * bits - 1, count), declared, rate)


_MAKERS: dict[str, Callable[[Any, int, int], Real]] = {"log_sweep": _log_sweep, "mls": _sequence}
