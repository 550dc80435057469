"""Conversion of samples to another rate, if a data set requests it."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray


@lru_cache(maxsize=8)
def _lowpass(up: int, down: int) -> NDArray[np.float64]:
    """Return `scipy.signal.resample_poly`'s default filter, kept: 44,101 Hz needs 882,021 taps."""
    from scipy.signal import firwin

    widest = max(up, down)
    return firwin(20 * widest + 1, 1 / widest, window=("kaiser", 5.0))


def resample(samples: NDArray[np.float32], from_hz: int, to_hz: int) -> NDArray[np.float32]:
    """Return samples (n,) at another rate, ceil(n to/from) of them: polyphase, zeros outside."""
    from scipy.signal import resample_poly

    common = math.gcd(from_hz, to_hz)
    up, down = to_hz // common, from_hz // common
    return resample_poly(samples, up, down, window=_lowpass(up, down)).astype(np.float32)
