"""Conversion of samples: to another rate where a data set asks for it, and to MP3 for pages.

MP3s are there to be heard, not measured: no feature is made of one.
"""

from __future__ import annotations

import io
import math
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Rates that MP3 has (Hz).
RATES = (8000, 11025, 12000, 16000, 22050, 24000, 32000, 44100, 48000)
#: libsndfile's scale of 0 to 1: 56 kbit/s at 44.1 kHz, which every browser plays.
COMPRESSION = 0.9
BYTES_PER_SECOND = 7500


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


def mp3_clip(samples: NDArray[Any], sample_rate_hz: int, gain: float = 1.0) -> bytes:
    """Return samples (n,), full scale ±1 after `gain`, as MP3: the same bytes each time.

    Rates that MP3 does not have are converted to 44.1 kHz. What exceeds full scale is clipped.
    """
    import soundfile

    scaled = np.clip(np.asarray(samples, np.float32) * np.float32(gain), -1, 1)
    if sample_rate_hz not in RATES:
        scaled, sample_rate_hz = resample(scaled, sample_rate_hz, 44_100), 44_100
    stream = io.BytesIO()
    settings: dict[str, Any] = {"bitrate_mode": "CONSTANT", "compression_level": COMPRESSION}
    soundfile.write(stream, scaled, sample_rate_hz, format="MP3", **settings)
    return stream.getvalue()
