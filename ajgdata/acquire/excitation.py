"""Played samples of a declared excitation. Equal declarations give equal samples.

Samples are float64 in [-1, 1] of full scale; a sound card gets them as float32. Fades are raised
cosines: sin²(π t / 2 T), where t is the time to the nearer end and T the length of the fade.

A logarithmic sweep has an energy density that falls by 3 dB per octave. The density of a linear
sweep, of a maximum-length sequence and of white noise is flat. At equal peak level the crest factor
(peak over rms) gives the played energy: 3 dB for sweeps (a sine's), 0 dB for the sequence, and
4.8 dB for white noise over all frequencies.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import max_len_seq

from ajgdata.acquire.card import FULL_SCALE
from ajgdata.store.audio import file_sha256, inspect_audio, read_audio
from ajgdata.store.sessions import inside
from ajgdata.types import (
    AudioSettings,
    DataError,
    ExcitationSpec,
    LinearSweep,
    LogSweep,
    MaximumLengthSequence,
    PassiveRecording,
    SoundFile,
    WhiteNoise,
)

Real = NDArray[np.float64]

#: Longest sound in a file, in s.
MAX_FILE_S = 60
#: Number of successive samples at full scale that are clipped.
CLIPPED_RUN = 3
_KEY = "excitation.file"


def played_samples(declared: ExcitationSpec, sample_rate_hz: int, project: Path) -> Real:
    """Return the samples (n,) of an excitation that is computed or in a file.

    `project` is the folder to which the path of a file is relative. Raises DataError for a file
    that cannot be played, and ValueError as `excitation_samples` does.
    """
    if isinstance(declared, SoundFile):
        sound = _read_sound(declared, sample_rate_hz, inside(project, declared.file))
        return _with_silence(sound, declared, sample_rate_hz)
    return excitation_samples(declared, sample_rate_hz)


@lru_cache(maxsize=32)
def excitation_samples(declared: ExcitationSpec, sample_rate_hz: int) -> Real:
    """Return the samples (n,) of a computed excitation.

    n = (silence_before_s + length_s + silence_s) rate. The array is read-only. Raises ValueError
    for a band that reaches beyond half the rate, for a sound shorter than two samples, and for
    kinds that are not computed.

    >>> from ajgdata.acquire.excitation import excitation_samples
    >>> from ajgdata.types import LogSweep
    >>> samples = excitation_samples(LogSweep(length_s=0.5, amplitude=0.9), 44_100)
    >>> samples.shape, bool(abs(samples).max() <= 0.9)
    ((22050,), True)
    """
    if isinstance(declared, (SoundFile, PassiveRecording)):
        raise ValueError(f"excitation.kind {declared.kind} has no computed sound")
    high = getattr(declared, "high_hz", None) or 0.0
    if high >= sample_rate_hz / 2:
        raise ValueError(
            f"excitation.high_hz {high:g} is not below half the rate of {sample_rate_hz} Hz"
        )
    count = round(declared.length_s * sample_rate_hz)
    if count < 2:
        raise ValueError(f"excitation.length_s {declared.length_s:g} is shorter than two samples")
    sound = _MAKERS[declared.kind](declared, count, sample_rate_hz)
    return _with_silence(sound, declared, sample_rate_hz)


def _with_silence(sound: Real, declared: Any, sample_rate_hz: int) -> Real:
    """Return a sound (n,) with its declared silence before and after it, read-only."""
    before = np.zeros(round(declared.silence_before_s * sample_rate_hz))
    after = np.zeros(round(declared.silence_s * sample_rate_hz))
    samples = np.concatenate([before, sound, after])
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


def _linear_sweep(declared: LinearSweep, count: int, rate: int) -> Real:
    """Return a sweep with f(t) = low + (high - low) t/T, phase 2π (low t + (high - low) t²/2T)."""
    time = np.arange(count) / rate
    slope = (declared.high_hz - declared.low_hz) / declared.length_s
    phase = 2 * np.pi * (declared.low_hz * time + slope * time**2 / 2)
    return _faded(np.sin(phase), declared, rate)


def _sequence(declared: MaximumLengthSequence, count: int, rate: int) -> Real:
    """Return a sequence of ±1. Its circular autocorrelation is N at 0, else -1, N = 2^order - 1.

    D. Rife and J. Vanderkooy, "Transfer-function measurement with maximum-length sequences",
    J. Audio Eng. Soc. 37 (1989).
    """
    order = declared.order or max(2, (count + 1).bit_length() - 1)
    bits = max_len_seq(order)[0].astype(np.float64)
    return _faded(np.resize(2 * bits - 1, count), declared, rate)


def _noise(declared: WhiteNoise, count: int, rate: int) -> Real:
    """Return independent samples, uniformly distributed between -1 and 1.

    A band is the part of their Fourier series between its limits, scaled to a peak of 1. Raises
    ValueError for a band that contains no frequency of this series.
    """
    sound = np.random.Generator(np.random.PCG64(declared.seed)).uniform(-1, 1, count)
    if declared.low_hz or declared.high_hz is not None:
        frequency = np.fft.rfftfreq(count, 1 / rate)
        high = rate / 2 if declared.high_hz is None else declared.high_hz
        is_inside = (frequency >= declared.low_hz) & (frequency <= high)
        if not is_inside.any():
            raise ValueError(
                f"excitation.low_hz {declared.low_hz:g} to {high:g} Hz contains no multiple of "
                f"{rate / count:g} Hz, the inverse of length_s"
            )
        sound = np.fft.irfft(np.fft.rfft(sound) * is_inside, count)
    return _faded(sound / np.abs(sound).max(), declared, rate)


def _read_sound(declared: SoundFile, rate: int, path: Path) -> Real:
    """Return the samples (n,) of a file, unchanged. Raises DataError if it cannot be played."""
    if not path.is_file():
        fix = "correct the path, which is relative to the folder of the project"
        raise DataError(_KEY, f"there is no {path}", fix)
    info = inspect_audio(path)
    if declared.sha256 and file_sha256(path) != declared.sha256:
        problem = f"{path} is not the file of excitation.sha256"
        raise DataError(_KEY, problem, "restore the file, or remove excitation.sha256")
    if info.sample_rate_hz != rate:
        problem = f"{path} is sampled at {info.sample_rate_hz} Hz, and the data set at {rate} Hz"
        raise DataError(_KEY, problem, "resample the file, or correct audio.sample_rate_hz")
    if info.channels != 1:
        problem = f"{path} has {info.channels} channels, and the speaker plays one"
        raise DataError(_KEY, problem, "write one channel")
    if info.frames > MAX_FILE_S * rate:
        problem = f"{path} has {info.frames / rate:.0f} s, and a sound has up to {MAX_FILE_S} s"
        raise DataError(_KEY, problem, "cut the file")
    samples = read_audio(path, AudioSettings(sample_rate_hz=rate)).samples.astype(np.float64)
    peak = float(np.abs(samples).max())
    if not np.isfinite(peak) or not peak:
        raise DataError(
            _KEY, f"{path} is silent, or has samples that are not numbers", "replace it"
        )
    at_full_scale = (np.abs(samples) >= FULL_SCALE).astype(int)
    is_clipped = np.convolve(at_full_scale, np.ones(CLIPPED_RUN, int)).max() == CLIPPED_RUN
    if peak > 1 or is_clipped:
        problem = f"{path} is clipped, or exceeds full scale (peak {peak:.4g})"
        raise DataError(_KEY, problem, "write it with a lower level")
    return samples


_MAKERS: dict[str, Callable[[Any, int, int], Real]] = {
    "log_sweep": _log_sweep,
    "linear_sweep": _linear_sweep,
    "mls": _sequence,
    "noise": _noise,
}
