"""Sweep tracking: each frequency is summed over the frames alone in which the sweep is there.

A sweep sounds at one frequency for a small part of its length, what rings after it a little longer;
in all other frames a bin holds noise alone. With E[f, k] the transform of the excitation, framed as
the recording is, the sum over time of bin k counts the frames

    T(k) = { f : |E[f - d, k]|^2 >= 1e-4 max_f |E[f, k]|^2   for a d of 0 ... D },
    D = ceil(decay_s rate / hop)

those in which the excitation is within 40 dB of its loudest there, and what follows within the
decay time. The pedestal that white noise makes falls by the share of the frames that count. A bin
in which nothing is played (40 dB below the mean of all) counts no frame: it is 0, not noise.

The transform of what was played decides, not a formula of its kind: so any sweep will do, imported
ones as well, and low frequencies, where a logarithmic one dwells, get the frames that they need.
What sounds at most of its frequencies most of the time is no sweep, and refused.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import scipy.fft
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from ajgdata.features.spectrum import Float32, periodic_window, spectrum
from ajgdata.types import FeatureSettings, NotPossibleError

#: Energy over the largest in the bin, or over the mean of all bins: -40 dB, as the transfer
#: function's regularisation.
HEARD = 1e-4
#: A frequency of a sweep sounds in a smaller share of the frames.
LARGEST_SHARE = 0.5


class SweepTracking:
    """Spectra of recordings (n,) of one sweep (m,), begun together; a latency is part of decay_s.

    Raises ValueError for an excitation that is silent, not finite, not (m,), or no sweep: one that
    sounds at its frequencies in half of the frames or more.

    >>> import numpy as np
    >>> from ajgdata.features.sweep_tracking import SweepTracking
    >>> from ajgdata.types import FeatureSettings, NotPossibleError
    >>> time = np.arange(44_100) / 44_100
    >>> sweep = np.sin(2 * np.pi * 10_000 * time**2)  # 0 to 20 kHz in a second
    >>> settings = FeatureSettings(kind="sweep_tracking", decay_s=0.02)
    >>> tracking = SweepTracking(sweep, 44_100, settings)
    >>> frames = tracking.counted(44_100)
    >>> frames.shape, int(frames[:, 465].sum())  # of 10 kHz: 5 with the sweep, 2 after it
    ((83, 1025), 7)
    >>> tracking.feature(sweep).shape
    (1025,)
    """

    def __init__(
        self, excitation: NDArray[Any], sample_rate_hz: float, settings: FeatureSettings
    ) -> None:
        played = np.asarray(excitation, np.float64)
        if played.ndim != 1 or not played.any() or not np.isfinite(played).all():
            raise NotPossibleError(
                "tracking needs an excitation (m,) that is finite and not silent"
            )
        self._rate, self._settings = sample_rate_hz, settings
        self._later = math.ceil(settings.decay_s * sample_rate_hz / settings.hop)
        self._heard = _heard(played, settings)
        self._counted: dict[int, Float32] = {}

    def counted(self, samples: int) -> Float32:
        """Return which frames of a recording of so many samples count: (frames, window/2 + 1) of 0
        and 1."""
        frames = 1 + (samples - self._settings.window) // self._settings.hop
        if frames not in self._counted:
            counted = np.zeros((frames, self._heard.shape[1]), bool)
            for late in range(min(self._later + 1, frames)):
                kept = self._heard[: frames - late]
                counted[late : late + len(kept)] |= kept
            self._counted[frames] = counted.astype(np.float32)
        return self._counted[frames]

    def feature(self, recording: NDArray[Any]) -> Float32:
        """Return the spectrum (n_bins,) of a recording (n,); see `spectrum`, also for errors."""
        samples = np.asarray(recording)
        settings = self._settings
        enough = samples.ndim == 1 and len(samples) >= settings.window
        counted = self.counted(len(samples)) if enough else np.empty((0, 0), np.float32)
        return spectrum(samples, self._rate, settings, counted)


def _heard(played: NDArray[np.float64], settings: FeatureSettings) -> NDArray[np.bool_]:
    """Return where an excitation (m,) sounds: (frames, window/2 + 1), its last samples included.

    Raises ValueError where it sounds everywhere.
    """
    window, hop = settings.window, settings.hop
    whole = max(len(played), window)
    padded = np.pad(played, (0, window + -(whole - window) % hop + whole - len(played)))
    frames = sliding_window_view(padded, window)[::hop]
    shape = periodic_window(settings.window_shape, window)
    energy = np.abs(scipy.fft.rfft(frames * shape)) ** 2
    largest = energy.max(axis=0)
    heard = (energy >= HEARD * largest) & (largest >= HEARD * largest.mean())
    sounding = energy.sum(axis=1) >= HEARD * energy.sum(axis=1).mean()
    share = heard[:, heard.any(axis=0)].sum(axis=0) / np.count_nonzero(sounding)
    if np.median(share) >= LARGEST_SHARE:
        raise NotPossibleError(
            "the played sound is no sweep that can be tracked: a frequency sounds in "
            f"{100 * np.median(share):.0f} % of the frames of {window} samples (less than "
            f"{100 * LARGEST_SHARE:.0f} % in a sweep)"
        )
    return heard
