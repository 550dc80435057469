"""Spectrum of a recording: short-time Fourier transform, summed over time and normalised.

Let x be the samples, w the window (length N) and h the hop. F = 1 + floor((n - N) / h) frames are
completely inside the signal. Nothing is padded, and a remainder shorter than one hop is not used.

    X[f, k] = sum_j  w[j] x[f h + j] exp(-2 pi i j k / N),     k = 0 ... N/2
    S[k]    = sum_f |X[f, k]|    (magnitude)   or   sum_f |X[f, k]|^2   (power)   or its root

Noise is in all frames, but the sound of a sweep is in a few frames of each bin. A sum of magnitudes
therefore has a floor of noise that grows with the number of frames. White noise of variance v adds
sqrt(pi v W)/2 per frame to the magnitude, and v W to the power, where W = sum_j w[j]^2.

S is limited to `band_hz` and divided by its own 1-norm, 2-norm or maximum. The paper states the
window length, the sum over time and that spectra are normalised. All other choices are settings
(FeatureSettings).

The transform is computed in float32, one block of frames at a time. The samples are scaled by the
power of two next to their peak, which is exact, so that no amplitude overflows or vanishes.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
import scipy.fft
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from ajgdata.features.compute import FeatureInput
from ajgdata.store.feature_array import FeatureArray, frequency_axis
from ajgdata.types import AudioSettings, FeatureKind, FeatureSettings
from ajgdata.types.features import ShortTime

Float32 = NDArray[np.float32]

#: Settings of a spectrum if none are given: the paper's window, and the defaults of this package.
DEFAULT_SETTINGS = FeatureSettings()
#: Samples that are transformed at once: 32 frames of 2048 (256 KiB) fit in the L2 cache of a core.
_BLOCK = 65_536


def frequencies_hz(
    sample_rate_hz: float, settings: ShortTime = DEFAULT_SETTINGS
) -> NDArray[np.float64]:
    """Return the centre frequencies (n_bins,) of the bins of a spectrum, in Hz.

    Raises ValueError if no bin lies within `band_hz`.

    >>> import ajgdata
    >>> settings = ajgdata.FeatureSettings(band_hz=(100, 180))
    >>> ajgdata.frequencies_hz(44_100, settings).round(1)
    array([107.7, 129.2, 150.7, 172.3])
    """
    return _all_frequencies(sample_rate_hz, settings)[band_bins(sample_rate_hz, settings)]


def spectrum(
    samples: NDArray[Any], sample_rate_hz: float, settings: FeatureSettings = DEFAULT_SETTINGS
) -> Float32:
    """Return the spectrum (n_bins,) of the samples (n,) of one recording, float32.

    The equation is at the head of `ajgdata/features/spectrum.py`; `settings` decide window,
    quantity, band and normalisation. By default, the values are shares with the sum 1, without a
    unit, and do not depend on the amplitude of the samples. The spectrum of silence is zero.
    Without normalisation, the unit is that of the samples (for a power, its square) times the
    number of samples of the window. Safe to call from several threads.

    Raises ValueError for samples that are shorter than one window, not one-dimensional or not
    finite, and for a spectrum without normalisation that exceeds float32.

    >>> import ajgdata
    >>> import numpy as np
    >>> tone = np.sin(2 * np.pi * 1000 * np.arange(44_100) / 44_100)  # one second of 1 kHz
    >>> values = ajgdata.spectrum(tone, 44_100)
    >>> values.shape, values.dtype, round(float(values.sum()), 3)
    ((1025,), dtype('float32'), 1.0)
    >>> float(ajgdata.frequencies_hz(44_100)[values.argmax()])  # the nearest bin, in Hz
    990.52734375
    """
    samples = np.asarray(samples)
    band = band_bins(sample_rate_hz, settings)
    exponent = _peak_exponent(samples, settings)
    if exponent is None:
        return np.zeros(band.stop - band.start, np.float32)
    if samples.dtype != np.float32 or abs(exponent) > 120:
        samples = np.ldexp(samples.astype(np.float64), -exponent).astype(np.float32)
        scale = 0
    else:
        scale = -exponent
    total = _summed(samples, settings, scale)[band]
    if settings.normalisation == "none":
        total_exponent = 2 * exponent if settings.quantity == "power" else exponent
        total = np.ldexp(total, total_exponent)
        if total.max() > np.finfo(np.float32).max:
            raise ValueError("the spectrum exceeds float32: set features.normalisation")
        return total.astype(np.float32)
    return normalised(total, settings.normalisation)


def spectra(sound: FeatureInput, settings: FeatureSettings) -> FeatureArray:
    """Return the spectrum (channel, frequency) of each microphone."""
    rate_hz = sound.sample_rate_hz
    values = np.stack([spectrum(row, rate_hz, settings) for row in sound.samples])
    return FeatureArray(values, (sound.channels, frequency_axis(frequencies_hz(rate_hz, settings))))


def normalised(values: NDArray[np.float64], normalisation: str) -> Float32:
    """Return values (n_bins,) over their norm `l1`, `l2` or `max`, unchanged for `none`."""
    if normalisation == "none":
        return values.astype(np.float32)
    norm = np.linalg.norm(values, {"l1": 1, "l2": 2, "max": np.inf}[normalisation])
    return (values / norm if norm else values).astype(np.float32)


def _peak_exponent(samples: NDArray[Any], settings: FeatureSettings) -> int | None:
    """Return the binary exponent of the peak of samples; None if they are silent.

    Raises ValueError for samples that have no spectrum.
    """
    if samples.ndim != 1:
        raise ValueError(f"need samples of shape (n,), got {samples.shape}")
    if len(samples) < settings.window:
        raise ValueError(
            f"{len(samples)} samples are fewer than one window of {settings.window}: "
            "record longer or set features.window"
        )
    peak = max(float(samples.max()), -float(samples.min()))
    if not math.isfinite(peak):
        raise ValueError("the samples hold NaN or infinity: run the checks first")
    return math.frexp(peak)[1] if peak else None


def _summed(samples: Float32, settings: FeatureSettings, exponent: int) -> NDArray[np.float64]:
    """Return the sum over time (window/2 + 1,) of the transform of `samples` times 2**exponent."""
    window = np.ldexp(
        periodic_window(settings.window_shape, settings.window).astype(np.float32), exponent
    )
    frames = sliding_window_view(samples, settings.window)[:: settings.hop]
    step = max(1, _BLOCK // settings.window)
    total = np.zeros(settings.window // 2 + 1)
    for start in range(0, len(frames), step):
        size = np.abs(scipy.fft.rfft(frames[start : start + step] * window))
        if settings.quantity != "magnitude":
            size = np.square(size)
        total += size.sum(axis=0)
    return np.sqrt(total) if settings.quantity == "root_power" else total


#: Coefficients of the cosines of each window, as in `scipy.signal.windows`. The import of this
#: module would take half a second.
_COSINES = {
    "hann": (0.5, 0.5),
    "hamming": (0.54, 1 - 0.54),
    "blackman": (0.42, 0.50, 0.08),
    "boxcar": (1.0,),
}


@lru_cache(maxsize=8)
def periodic_window(shape: str, length: int) -> NDArray[np.float64]:
    """Return a periodic window (length,), which is a sum of cosines."""
    angle = np.linspace(-np.pi, np.pi, length + 1)[:-1]
    window = np.zeros(length)
    for order, coefficient in enumerate(_COSINES[shape]):
        window += coefficient * np.cos(order * angle)
    return window


@lru_cache(maxsize=32)
def band_bins(sample_rate_hz: float, settings: ShortTime) -> slice:
    """Return the slice of the bins within `band_hz`. Raises ValueError if there are no bins."""
    frequencies = _all_frequencies(sample_rate_hz, settings)
    if settings.band_hz is None:
        return slice(0, len(frequencies))
    low, high = settings.band_hz
    start = np.searchsorted(frequencies, low)
    stop = np.searchsorted(frequencies, high, "right")
    if start == stop:
        raise ValueError(
            f"no bin lies within band_hz {low:g} to {high:g} Hz "
            f"(bins every {sample_rate_hz / settings.window:g} Hz up to {frequencies[-1]:g} Hz)"
        )
    return slice(int(start), int(stop))


def _all_frequencies(sample_rate_hz: float, settings: ShortTime) -> NDArray[np.float64]:
    """Return the centre frequencies (window/2 + 1,) of all bins in Hz."""
    bin_hz = sample_rate_hz / settings.window
    return np.arange(settings.window // 2 + 1, dtype=np.float64) * bin_hz


def within(
    feature: NDArray[Any],
    frequency_hz: NDArray[np.float64],
    band_hz: tuple[float, float],
    normalisation: str,
) -> tuple[Float32, NDArray[np.float64]]:
    """Return the bins of features (n, f) with low <= frequency <= high, and their frequencies.

    The bins are divided by their own norm (see `FeatureSettings.normalisation`). Except for
    rounding errors, the result is the feature with this `band_hz`, because sound outside the band
    is neither in a bin nor in the norm. Raises ValueError for a band without bins.

    >>> import numpy as np
    >>> from ajgdata.features.spectrum import within
    >>> shares = np.array([[0.5, 0.1, 0.3, 0.1]], np.float32)
    >>> within(shares, np.array([0.0, 10.0, 20.0, 30.0]), (10, 25), "l1")
    (array([[0.25, 0.75]], dtype=float32), array([10., 20.]))
    """
    low, high = band_hz
    inside = (frequency_hz >= low) & (frequency_hz <= high)
    if not inside.any():
        raise ValueError(f"no bin of the feature lies within {low:g} to {high:g} Hz")
    rows = [normalised(row, normalisation) for row in feature[:, inside].astype(np.float64)]
    return np.reshape(rows, (len(feature), -1)).astype(np.float32), frequency_hz[inside]


def differing_axes(
    own: Mapping[str, Mapping[str, Any]], other: Mapping[str, Mapping[str, Any]]
) -> list[tuple[str, Any, Any]]:
    """Return the settings in which two feature files differ, with both values.

    `own` and `other` are the attributes `audio` and `features` of the files, as in JSON. The
    frequencies of the bins follow from sample rate, window and band.
    """
    keys = [("audio", "sample_rate_hz")]
    names = [*own.get("features", {}), *other.get("features", {})]
    keys += [("features", key) for key in dict.fromkeys(names)]
    differences = []
    for part, key in keys:
        own_value = own.get(part, {}).get(key)
        other_value = other.get(part, {}).get(key)
        if own_value != other_value:
            differences.append((f"{part}.{key}", own_value, other_value))
    return differences


def settings_text(audio: AudioSettings, features: FeatureKind) -> str:
    """Return the settings of features as JSON; features with equal texts are comparable."""
    settings = {
        "audio": audio.model_dump(mode="json"),
        "features": features.model_dump(mode="json"),
    }
    return json.dumps(settings, sort_keys=True)
