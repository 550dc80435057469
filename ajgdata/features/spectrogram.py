"""Spectrogram of a recording: the short-time Fourier transform without a sum over time.

    P[f, k] = |X[f, k]|    (magnitude)   or   |X[f, k]|^2   (power)

X is the transform of `features.spectrum`, without padding, in the first `length_s` seconds. All
values of a microphone are divided by one norm, so their level relative to each other remains.
"""

from __future__ import annotations

import numpy as np
import scipy.fft
from numpy.lib.stride_tricks import sliding_window_view

from ajgdata.features.compute import FeatureInput
from ajgdata.features.spectrum import band_bins, frequencies_hz, normalised, periodic_window
from ajgdata.store.feature_array import Axis, FeatureArray, frequency_axis
from ajgdata.types.features import ShortTime, SpectrogramSettings

TIME = "time"
_TIME_ATTRS = {"units": "s", "long_name": "time of the middle of the window"}


def spectrograms(sound: FeatureInput, settings: SpectrogramSettings) -> FeatureArray:
    """Return the spectrogram (channel, time, frequency) of each microphone."""
    rate_hz = sound.sample_rate_hz
    band = band_bins(rate_hz, settings)
    count = settings.least_samples(rate_hz)
    rows = []
    for samples in sound.samples:
        power = short_time_power(samples[:count], settings)[:, band]
        values = power if settings.is_power else np.sqrt(power)
        rows.append(normalised(values.ravel(), settings.normalisation).reshape(values.shape))
    time = time_axis(len(rows[0]), rate_hz, settings)
    frequency = frequency_axis(frequencies_hz(rate_hz, settings))
    return FeatureArray(np.stack(rows), (sound.channels, time, frequency))


def short_time_power(samples: np.ndarray, settings: ShortTime) -> np.ndarray:
    """Return |X|^2 (frames, window/2 + 1), float64, of samples (n,).

    Raises ValueError for samples that are shorter than one window.
    """
    if len(samples) < settings.window:
        raise ValueError(f"{len(samples)} samples are fewer than one window of {settings.window}")
    transform = short_time_transform(samples, settings)
    return np.square(transform.real) + np.square(transform.imag)


def short_time_transform(samples: np.ndarray, settings: ShortTime) -> np.ndarray:
    """Return the transform X (frames, window/2 + 1), complex128, of samples (n,)."""
    window = periodic_window(settings.window_shape, settings.window)
    frames = sliding_window_view(samples.astype(np.float64), settings.window)[:: settings.hop]
    transform: np.ndarray = scipy.fft.rfft(frames * window)
    return transform


def time_axis(frames: int, sample_rate_hz: float, settings: ShortTime) -> Axis:
    """Return the axis of the middles of `frames` windows, in s."""
    middle = np.arange(frames) * settings.hop + settings.window / 2
    return Axis(TIME, middle / sample_rate_hz, _TIME_ATTRS)
