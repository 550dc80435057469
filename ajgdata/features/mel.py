"""Levels in bands of equal width on the mel scale, and their cepstra (MFCC).

Let |X[f, k]|^2 be the power of `features.spectrogram`, or its mean over f. Band m is a triangle
H_m over frequency, which rises from the centre of band m - 1 to 1 at its own centre, and falls to
0 at the centre of band m + 1. The centres are equally spaced in mel:

    htk       mel(f) = 2595 log10(1 + f / 700)                            (Young et al. 2006, HTK)
    slaney    mel(f) = 3 f / 200 below 1 kHz, 15 + 27 ln(f / 1000) / ln 6.4 above
                                                                  (Slaney 1998, Auditory Toolbox)

    L[m] = 10 log10 max(E[m], 10^(floor_db / 10) max E),   E[m] = sum_k H_m[k] |X[k]|^2
    c[q] = sqrt(2 / M) sum_m L[m] cos(pi q (m + 1/2) / M),   for q = 0 divided by sqrt(2)

With `normalisation: max`, L is relative to the highest level of the recording and microphone.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import scipy.fft

from ajgdata.features.compute import FeatureInput
from ajgdata.features.spectrogram import short_time_power, time_axis
from ajgdata.store.feature_array import Axis, FeatureArray
from ajgdata.types.features import MelSettings

MEL = "mel"
CEPSTRUM = "cepstrum"
_MEL_ATTRS = {"units": "Hz", "long_name": "centre of the mel band"}
_CEPSTRUM_ATTRS = {"units": "1", "long_name": "number of the cepstral coefficient"}


def mel_levels(sound: FeatureInput, settings: MelSettings) -> FeatureArray:
    """Return levels in dB (channel, [time], mel), or cepstra (channel, [time], cepstrum).

    Raises ValueError for a recording without sound, and for bands that contain no bin.
    """
    rate_hz = sound.sample_rate_hz
    filters, centres_hz = filter_bank(rate_hz, settings)
    rows = [_levels(samples, rate_hz, filters, settings) for samples in sound.samples]
    axes = [sound.channels]
    if settings.over_time == "frames":
        axes.append(time_axis(len(rows[0]), rate_hz, settings))
    if settings.cepstra is None:
        axes.append(Axis(MEL, centres_hz, _MEL_ATTRS))
    else:
        axes.append(Axis(CEPSTRUM, np.arange(settings.cepstra, dtype=np.int32), _CEPSTRUM_ATTRS))
    return FeatureArray(np.stack(rows), tuple(axes))


def _levels(
    samples: np.ndarray, rate_hz: float, filters: np.ndarray, settings: MelSettings
) -> np.ndarray:
    """Return levels or cepstra ([frames,] values) of the samples (n,) of one microphone."""
    if settings.over_time == "frames":
        energy = short_time_power(samples[: settings.least_samples(rate_hz)], settings) @ filters.T
    else:
        energy = short_time_power(samples, settings).mean(axis=0) @ filters.T
    highest = energy.max()
    if highest <= 0:
        raise ValueError("there is no sound in any mel band")
    level = 10 * np.log10(np.maximum(energy / highest, 10 ** (settings.floor_db / 10)))
    if settings.normalisation == "none":
        level += 10 * np.log10(highest)
    if settings.cepstra is None:
        return level
    cepstra: np.ndarray = scipy.fft.dct(level, norm="ortho")[..., : settings.cepstra]
    return cepstra


@lru_cache(maxsize=8)
def filter_bank(sample_rate_hz: float, settings: MelSettings) -> tuple[np.ndarray, np.ndarray]:
    """Return the triangles H (bands, window/2 + 1), and the centres (bands,) of the bands in Hz.

    Raises ValueError if a band contains no bin.
    """
    low, high = settings.band_hz or (0.0, sample_rate_hz / 2)
    high = min(high, sample_rate_hz / 2)
    edges = np.linspace(_mel(low, settings.scale), _mel(high, settings.scale), settings.bands + 2)
    edges_hz = np.array([_hz(edge, settings.scale) for edge in edges])
    frequency = np.arange(settings.window // 2 + 1) * sample_rate_hz / settings.window
    before, centre, after = (edges_hz[start : start + settings.bands, None] for start in range(3))
    rising = (frequency - before) / (centre - before)
    falling = (after - frequency) / (after - centre)
    filters = np.clip(np.minimum(rising, falling), 0, None)
    if not filters.any(axis=1).all():
        raise ValueError(
            f"{settings.bands} mel bands are too narrow for a window of {settings.window}: "
            "lower features.bands or increase features.window"
        )
    return filters, edges_hz[1:-1]


#: Slaney's scale: end of its linear part in Hz and in mel, and mel per factor e above.
_BREAK_HZ = 1000.0
_BREAK_MEL = 15.0
_MEL_PER_E = 27 / np.log(6.4)


def _mel(frequency_hz: float, scale: str) -> float:
    """Return a frequency in mel.

    >>> from ajgdata.features.mel import _mel
    >>> round(_mel(1000.0, "htk")), round(_mel(1000.0, "slaney"), 6)
    (1000, 15.0)
    """
    if scale == "htk":
        return float(2595 * np.log10(1 + frequency_hz / 700))
    if frequency_hz < _BREAK_HZ:
        return _BREAK_MEL * frequency_hz / _BREAK_HZ
    return float(_BREAK_MEL + _MEL_PER_E * np.log(frequency_hz / _BREAK_HZ))


def _hz(mel: float, scale: str) -> float:
    """Return the frequency in Hz of a value in mel."""
    if scale == "htk":
        return float(700 * (10 ** (mel / 2595) - 1))
    if mel < _BREAK_MEL:
        return _BREAK_HZ * mel / _BREAK_MEL
    return float(_BREAK_HZ * np.exp((mel - _BREAK_MEL) / _MEL_PER_E))
