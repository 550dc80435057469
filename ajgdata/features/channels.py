"""Level and correlation of the channels of a file: are they microphones of the same sound?

A second channel can be a second microphone, a copy of the first, a loop-back of the played sound,
or an input without a cable. Only channels that contain nearly the same sound may be averaged.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

#: Largest difference in level (dB) of channels that are averaged without a question: the louder
#: channel of two contributes 10 times the power of the other one.
MAX_LEVEL_DB = 10.0
#: Least correlation of channels that are averaged without a question. Two equally loud channels of
#: correlation r have a mean of (1 + r)/2 times their power: 1 for equal sounds, 1/2 for independent
#: sounds. At r = 1/2 the mean has lost half of that difference. The correlation is measured without
#: a delay and with its sign, as the mean is taken: a delay of d seconds between two microphones
#: cancels the frequency 1/(2 d), and opposite signs cancel every frequency. A loop-back of a sweep
#: hardly correlates with the response of a gripper, which changes the phase of each frequency.
#: Simulated responses of docs/examples/make_takes.py at 44.1 kHz: 0.00 with a loop-back, 0.7 with
#: a microphone that is one sample later (8 mm), 0.1 with two samples.
MIN_CORRELATION = 0.5
#: Level (dB of full scale) that is printed for a channel of zeros.
SILENCE_DBFS = -200.0


@dataclass(frozen=True)
class ChannelStatistics:
    """Medians over files: level (channels,) in dB of full scale, and correlation of each pair
    (channels, channels), NaN for a channel without sound."""

    level_dbfs: NDArray[np.float64]
    correlation: NDArray[np.float64]

    @property
    def lowest_correlation(self) -> NDArray[np.float64]:
        """Return the lowest correlation (channels,) of each channel with another one."""
        is_own = np.eye(len(self.correlation), dtype=bool)
        return np.where(is_own, np.inf, self.correlation).min(axis=1)

    @property
    def level_range_db(self) -> float:
        """Return the difference in level between the loudest and the quietest channel."""
        return float(np.ptp(self.level_dbfs))

    @property
    def are_alike(self) -> bool:
        """Return True if the channels contain nearly the same sound (see the limits above)."""
        correlates = self.lowest_correlation >= MIN_CORRELATION  # False for NaN
        return self.level_range_db <= MAX_LEVEL_DB and bool(correlates.all())

    @property
    def have_opposite_signs(self) -> bool:
        """Return True if two channels contain nearly the same sound with opposite signs."""
        return bool((self.lowest_correlation <= -MIN_CORRELATION).any())

    def text(self) -> str:
        """Return level and correlation of each channel in one line."""
        pairs = zip(self.level_dbfs, self.lowest_correlation, strict=True)
        return "; ".join(
            f"microphone {number}: level {_level_text(level)}, correlation {_number_text(r)}"
            for number, (level, r) in enumerate(pairs, 1)
        )


def channel_statistics(recordings: Sequence[NDArray[np.float32]]) -> ChannelStatistics | None:
    """Return the statistics of recordings (frames, channels) with equal numbers of channels.

    Recordings without sound in every channel, with NaN or with infinity are not used; None if no
    recording is left. Level: root mean square without the offset.
    """
    levels = []
    correlations = []
    for recording in recordings:
        samples = recording.astype(np.float64)
        if not len(samples) or not np.isfinite(samples).all():
            continue
        samples -= samples.mean(axis=0)
        covariance = samples.T @ samples / len(samples)
        rms = np.sqrt(np.diag(covariance))
        floor = 10 ** (SILENCE_DBFS / 20)
        if not np.any(rms > floor):
            continue
        levels.append(20 * np.log10(np.maximum(rms, floor)))
        with np.errstate(divide="ignore", invalid="ignore"):
            correlations.append(np.where(rms > floor, covariance / np.outer(rms, rms), np.nan))
    if not levels:
        return None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a channel without sound in every file
        correlation = np.nanmedian(correlations, axis=0)
    return ChannelStatistics(np.median(levels, axis=0), correlation)


def _level_text(level_dbfs: float) -> str:
    return "silent" if level_dbfs <= SILENCE_DBFS else f"{level_dbfs:.1f} dBFS"


def _number_text(correlation: float) -> str:
    return "none" if np.isnan(correlation) else f"{correlation:.2f}"
