"""Levels of a recording in bands, and how they differ from earlier grasps of the object."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: Half-octave bands from 30 Hz on: 19 of them at 44.1 kHz, as many characters on a terminal.
LOWEST_HZ, BANDS_PER_OCTAVE = 30.0, 2
#: A level this far from the earlier ones of the object is a knob or a plug: grasps differ by less.
JUMP_DB = 12.0
_FLOOR = 1e-12  # of full scale squared: -120 dB, below any converter's noise


@dataclass(frozen=True)
class Level:
    """Peak in dB of full scale, and the level in each band in dB (n_bands,)."""

    peak_dbfs: float
    bands_db: NDArray[np.float64]


def level_of(samples: ArrayLike, sample_rate_hz: float) -> Level:
    """Return the levels of a recording (n,), full scale ±1.

    The level of a band is its share of the mean square (Parseval), in dB of full scale squared.
    """
    sound = np.asarray(samples, dtype=np.float64)
    power = np.abs(np.fft.rfft(sound)) ** 2 * (2 / len(sound) ** 2)
    edges = band_edges_hz(sample_rate_hz)
    bins = np.searchsorted(np.fft.rfftfreq(len(sound), 1 / sample_rate_hz), edges)
    sums = np.concatenate([[0.0], np.cumsum(power)])
    bands = np.diff(sums[bins])
    peak = float(np.abs(sound).max())
    return Level(
        10 * float(np.log10(max(peak**2, _FLOOR))), 10 * np.log10(np.maximum(bands, _FLOOR))
    )


def band_edges_hz(sample_rate_hz: float) -> NDArray[np.float64]:
    """Return the edges (n_bands + 1,) of the bands below half the rate."""
    octaves = np.log2(sample_rate_hz / 2 / LOWEST_HZ)
    return np.asarray(
        LOWEST_HZ * 2 ** (np.arange(int(octaves * BANDS_PER_OCTAVE) + 1) / BANDS_PER_OCTAVE)
    )


def usual(levels: Sequence[Level]) -> Level | None:
    """Return the median of several levels; None of none."""
    if not levels:
        return None
    peaks = [level.peak_dbfs for level in levels]
    return Level(float(np.median(peaks)), np.median([one.bands_db for one in levels], axis=0))


def jump_db(level: Level, earlier: Level | None) -> float:
    """Return how much louder the peak is than the earlier ones, in dB, if that is a jump; else
    0."""
    if earlier is None or abs(level.peak_dbfs - earlier.peak_dbfs) <= JUMP_DB:
        return 0.0
    return level.peak_dbfs - earlier.peak_dbfs
