"""Check of mains hum: lines at 50 or 60 Hz and harmonics that last for the whole recording.

A sweep also contains 50 and 60 Hz, but passes them within a few segments. A line of the mains has
the same amplitude and phase in all segments.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ajgdata.features.segments import Segments
from ajgdata.features.share import LINE_GAIN, SHARE_LIMIT, may_exceed, share
from ajgdata.store.audio import Remark
from ajgdata.types.features import ALL_HZ

#: Frequencies of the mains, and number of their harmonics that are examined.
MAINS_HZ = (50, 60)
_HARMONICS = 6
#: Subharmonics of the mains: a periodic sound of this pitch has harmonics at those of the mains.
_LOWER_HZ = (10, 50 / 3, 20, 25, 30)
#: Least number of segments. Two neighbouring segments have whole periods, and three such pairs show
#: that a line is steady.
_MIN_SEGMENTS = 4
#: A line is steady if three quarters of the pairs differ from the median by less than half of it. A
#: logarithmic sweep of one second passes 50 Hz +-10 Hz in 0.06 s, which is 3 of 19 pairs.
_STEADY_PART = 0.75
_DEVIATION = 0.5
#: Hum has several lines, because transformers and rectifiers distort the mains. One line can be a
#: tone or a resonance. Lines below a tenth (-20 dB) of the largest line are ignored.
_MIN_LINES = 2
_LEAST_LINE = 0.1
#: The harmonics have 50 or 60 Hz in common or, after a rectifier, 100 or 120 Hz.
_RECTIFIED = 2


def check_hum(
    samples: NDArray[np.float32],
    parts: Segments,
    sample_rate_hz: float,
    lines_hz: tuple[float, float] = ALL_HZ,
) -> Remark | None:
    """Return a warning if mains hum has more than SHARE_LIMIT of the spectrum.

    `samples` (n,) have the segments `parts`. All lines show that the hum is that of the mains, but
    only lines within `lines_hz` reach the spectrum. There is no warning about a recording shorter
    than 0.2 s, which does not show that a line is steady.
    """
    if len(parts.rms) < _MIN_SEGMENTS:
        return None
    median, pairs, lower = line_amplitudes(parts, sample_rate_hz)
    largest = LINE_GAIN * float(np.abs(median).sum(axis=1).max())
    if not may_exceed(largest, parts.mean_rms - math.sqrt(2) * largest):
        return None
    near = np.abs(pairs - median) < _DEVIATION * np.abs(median)
    lines = np.where(near.mean(axis=0) >= _STEADY_PART, median, 0)
    for row, mains_hz in enumerate(MAINS_HZ):
        amplitudes = np.abs(lines[row])
        numbers = 1 + np.flatnonzero(amplitudes > _LEAST_LINE * amplitudes.max())
        count = len(numbers)
        is_mains = count >= _MIN_LINES and np.gcd.reduce(numbers) <= _RECTIFIED
        if not is_mains or lower >= amplitudes.max():
            continue
        frequency_hz = mains_hz * (1 + np.arange(_HARMONICS))
        reaches = (lines_hz[0] <= frequency_hz) & (frequency_hz <= lines_hz[1])
        component = LINE_GAIN * float(amplitudes[reaches].sum())
        power = float(np.square(amplitudes).sum()) / 2
        variance = np.square(parts.rms, dtype=np.float64) - power
        if not may_exceed(component, float(np.sqrt(np.maximum(variance, 0)).mean())):
            continue
        hum = synthesised(lines[row], mains_hz, len(samples), sample_rate_hz)
        part = share(component, samples - hum, sample_rate_hz)
        if part > SHARE_LIMIT:
            problem = (
                f"mains hum of {mains_hz} Hz ({count} steady lines):"
                f" {100 * part:.0f} % of the spectrum"
            )
            fix = (
                "remove the ground loop or shield the cables and record again, or set "
                "features.band_hz so that it excludes the lines"
            )
            return Remark("warning", "hum", problem, fix)
    return None


def line_amplitudes(
    parts: Segments, sample_rate_hz: float
) -> tuple[NDArray[np.complex64], NDArray[np.complex64], float]:
    """Return complex amplitudes of the lines of the mains, and the largest one of the subharmonics.

    The amplitudes are the median (mains, harmonics), and those of each pair of neighbouring
    segments (pairs, mains, harmonics). The phase is that at the first sample. There are at least
    two segments.
    """
    demodulation, rotation = _basis(*parts.means.shape, parts.block, float(sample_rate_hz))
    unrotated: NDArray[np.complex64] = (parts.means @ demodulation).view(np.complex64)
    lines = unrotated * rotation
    pairs = (lines[:-1] + lines[1:]) * np.complex64(0.5)
    ordered = np.sort(pairs.view(np.float32), axis=0)  # real and imaginary parts
    median: NDArray[np.complex64] = ordered[len(pairs) // 2].view(np.complex64)
    count = len(MAINS_HZ) * _HARMONICS
    shape = (len(MAINS_HZ), _HARMONICS)
    lower = float(np.abs(median[count:]).max())
    return median[:count].reshape(shape), pairs[:, :count].reshape(len(pairs), *shape), lower


@lru_cache(maxsize=8)
def _basis(
    count: int, blocks: int, block: int, sample_rate_hz: float
) -> tuple[NDArray[np.float32], NDArray[np.complex64]]:
    """Return the demodulation of a segment (blocks, 2 lines), real and imaginary parts in turn, and
    the phase of each line at the begin of each segment (count, lines).

    The demodulation corrects the attenuation of a line by the mean over a block.
    """
    mains_hz = np.outer(MAINS_HZ, np.arange(1, _HARMONICS + 1)).ravel()
    frequency_hz = np.concatenate([mains_hz, _LOWER_HZ])
    middle_s = (np.arange(blocks) * block + (block - 1) / 2) / sample_rate_hz
    start_s = np.arange(count) * blocks * block / sample_rate_hz
    gain = 2 / blocks / np.sinc(frequency_hz * block / sample_rate_hz)
    demodulation = gain * np.exp(-2j * np.pi * np.outer(middle_s, frequency_hz))
    rotation = np.exp(-2j * np.pi * np.outer(start_s, frequency_hz))
    return demodulation.astype(np.complex64).view(np.float32), rotation.astype(np.complex64)


def synthesised(
    lines: NDArray[np.complex64], mains_hz: float, count: int, sample_rate_hz: float
) -> NDArray[np.float32]:
    """Return the sound (count,) of lines (harmonics,) of the mains."""
    time_s = np.arange(count) / sample_rate_hz
    hum = np.zeros(count)
    for number in np.flatnonzero(lines):
        phase = 2j * np.pi * mains_hz * (number + 1) * time_s
        hum += (lines[number] * np.exp(phase)).real
    return hum.astype(np.float32)
