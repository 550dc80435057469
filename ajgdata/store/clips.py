"""Recordings -> short MP3s in memory, for pages on which they are to be heard, not measured."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ajgdata.store.resampling import resample

#: Rates that MP3 has (Hz).
RATES = (8000, 11025, 12000, 16000, 22050, 24000, 32000, 44100, 48000)
#: libsndfile's scale of 0 to 1: 56 kbit/s at 44.1 kHz, which every browser plays.
COMPRESSION = 0.9
BYTES_PER_SECOND = 7500


def mp3_clip(samples: NDArray[Any], sample_rate_hz: int, gain: float = 1.0) -> bytes:
    """Samples (n,), full scale ±1 after `gain`, as MP3: the same bytes each time.

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
