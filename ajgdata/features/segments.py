"""Segments of a recording: block means, which are a recording at a low rate, and levels.

One pass over the samples serves the checks of offset and hum.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

#: 2.5 periods of 50 Hz and 3 periods of 60 Hz: two segments hold whole periods of both.
SEGMENT_S = 0.05
#: Rate of the block means; half of it exceeds the sixth harmonic of 60 Hz.
_BLOCK_RATE_HZ = 1_400


@dataclass(frozen=True)
class Segments:
    """Segments of samples, without the incomplete last one.

    `means` (segments, blocks) are the means of blocks of `block` samples, `rms` (segments,) is the
    root mean square of the samples. `mean` and `mean_rms` are the means of both, 0 without
    segments.
    """

    means: NDArray[np.float32]
    rms: NDArray[np.float32]
    block: int
    mean: float
    mean_rms: float


def segments(samples: NDArray[np.float32], sample_rate_hz: float) -> Segments:
    """Return the segments of samples (n,); none if the recording is shorter than a segment."""
    block = max(1, int(sample_rate_hz / _BLOCK_RATE_HZ))
    blocks = max(1, round(SEGMENT_S * sample_rate_hz / block))
    count = len(samples) // (block * blocks)
    whole = np.ascontiguousarray(samples[: count * blocks * block], np.float32)
    weights = np.full(block, 1 / block, np.float32)
    means = whole.reshape(count * blocks, block) @ weights
    rows = whole.reshape(count, blocks * block)
    with np.errstate(over="ignore", under="ignore"):
        rms = np.sqrt(np.einsum("ij,ij->i", rows, rows) / max(1, blocks * block))
    # np.add.reduce is four times as fast as np.mean for a few numbers
    mean = float(np.add.reduce(means)) / max(1, len(means))
    mean_rms = float(np.add.reduce(rms)) / max(1, count)
    return Segments(means.reshape(count, blocks), rms, block, mean, mean_rms)
