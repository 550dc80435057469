"""Transfer function from a reference x to each microphone y, and their coherence.

The cross spectra are sums over the windows of Welch's method (X and Y are the transforms of
`features.spectrogram`):

    S_xx = sum_f |X|^2,   S_yy = sum_f |Y|^2,   S_xy = sum_f conj(X) Y
    H1 = S_xy / S_xx                     has no bias by noise in y (Bendat and Piersol 2010)
    gamma^2 = |S_xy|^2 / (S_xx S_yy)     is the share of the power of y that is linear in x

The feature is |H1| in bins whose coherence gamma^2 is at least `least_coherence`, and 0 in all
others. F windows of independent sounds have a mean coherence of about 1/F, so at least eight
windows are required. The played sound is continued with zeros, or cut to the recording.
"""

from __future__ import annotations

import numpy as np

from ajgdata.features.compute import FeatureInput
from ajgdata.features.spectrogram import short_time_transform
from ajgdata.features.spectrum import band_bins, frequencies_hz, normalised
from ajgdata.store.feature_array import FeatureArray, channel_axis, frequency_axis
from ajgdata.types.features import TransferFunctionSettings

#: Share of the bins of a band whose coherence may be too low without a warning.
_INCOHERENT_SHARE = 0.5


def transfer_functions(sound: FeatureInput, settings: TransferFunctionSettings) -> FeatureArray:
    """Return |H1| (channel, frequency) of each microphone other than the reference.

    Raises ValueError without a played sound, and for a microphone without any coherent bin.
    """
    if settings.needs_played:
        reference = _played(sound)
        rows = list(range(len(sound.samples)))
    else:
        number = sound.microphones.index(int(settings.reference))
        reference = sound.samples[number]
        rows = [row for row in range(len(sound.samples)) if row != number]
    band = band_bins(sound.sample_rate_hz, settings)
    x = short_time_transform(reference, settings)
    values = []
    coherent_shares = []
    for row in rows:
        y = short_time_transform(sound.samples[row], settings)
        estimate, coherence = _h1(x, y)
        is_coherent = coherence[band] >= settings.least_coherence
        if not is_coherent.any():
            raise ValueError(
                f"no bin has a coherence of {settings.least_coherence:g} with the reference: check "
                "features.reference, and whether the recording has the played sound"
            )
        magnitude = np.where(is_coherent, np.abs(estimate[band]), 0)
        values.append(normalised(magnitude, settings.normalisation))
        coherent_shares.append(float(is_coherent.mean()))
    axes = (
        channel_axis(tuple(sound.microphones[row] for row in rows)),
        frequency_axis(frequencies_hz(sound.sample_rate_hz, settings)),
    )
    return FeatureArray(np.stack(values), axes, _doubts(min(coherent_shares)))


def h1(
    reference: np.ndarray, response: np.ndarray, settings: TransferFunctionSettings
) -> tuple[np.ndarray, np.ndarray]:
    """Return H1 (window/2 + 1,), complex, and the coherence (window/2 + 1,).

    `reference` and `response` are samples (n,). Both results are 0 in bins in which one of them
    has no power.

    >>> import numpy as np
    >>> from ajgdata.features.transfer_function import h1
    >>> from ajgdata.types.features import TransferFunctionSettings
    >>> noise = np.random.default_rng(0).standard_normal(44_100)
    >>> estimate, coherence = h1(noise, 0.5 * noise, TransferFunctionSettings())
    >>> float(abs(estimate).mean().round(6)), float(coherence.mean().round(6))
    (0.5, 1.0)
    """
    x = short_time_transform(reference, settings)
    return _h1(x, short_time_transform(response, settings))


def _h1(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return H1 and coherence of transforms (frames, bins) of the reference and the response."""
    power_x = np.square(np.abs(x)).sum(axis=0)
    power_y = np.square(np.abs(y)).sum(axis=0)
    cross = (np.conj(x) * y).sum(axis=0)
    has_power = (power_x > 0) & (power_y > 0)
    power_x = np.where(has_power, power_x, 1)
    power_y = np.where(has_power, power_y, 1)
    estimate = np.where(has_power, cross / power_x, 0)
    coherence = np.where(has_power, np.square(np.abs(cross)) / (power_x * power_y), 0)
    return estimate, coherence


def _played(sound: FeatureInput) -> np.ndarray:
    """Return the played sound with the length of the recording (n,)."""
    if sound.played is None:
        raise ValueError("the played sound is not known: set features.reference to a microphone")
    count = sound.samples.shape[1]
    played = np.zeros(count)
    used = sound.played[:count]
    played[: len(used)] = used
    return played


def _doubts(coherent_share: float) -> tuple[tuple[str, str, str], ...]:
    """Return a doubt if the coherence is too low in a large share of the band."""
    if coherent_share >= _INCOHERENT_SHARE:
        return ()
    problem = f"only {100 * coherent_share:.0f} % of the bins are coherent with the reference"
    fix = "reduce the noise, or set features.band_hz to the band of the played sound"
    return (("low_coherence", problem, fix),)
