"""Frequencies of lines that reach the bins of a feature; defects at others do not change it."""

from __future__ import annotations

import math

#: Lowest and highest frequency in Hz for a feature that has all bins.
ALL_HZ = (-math.inf, math.inf)


def reaching_hz(
    band_hz: tuple[float, float] | None, window: int, sample_rate_hz: float
) -> tuple[float, float]:
    """Return the lowest and highest frequency in Hz of lines that reach a bin of `band_hz`.

    A line also reaches the neighbours of its bin, because the main lobe of the Hann window of
    `window` samples has a width of four bins. An offset is a line at 0 Hz.
    """
    if band_hz is None:
        return ALL_HZ
    bin_hz = sample_rate_hz / window
    lowest, highest = band_hz
    return lowest - bin_hz, highest + bin_hz
