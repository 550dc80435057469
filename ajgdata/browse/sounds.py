"""A sound as a page shows and plays it: waveform, spectrogram, and bytes of a WAV file."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import scipy.fft

from ajgdata.features.spectrum import periodic_window
from ajgdata.store.audio import AudioInfo, Float32, inspect_audio, pcm24_bytes, read_audio
from ajgdata.types import AudioSettings, Segment

#: Columns of a drawn waveform and of a drawn spectrogram, and rows of the latter.
PEAKS = 1000
COLUMNS = 500
ROWS = 160
#: Lowest frequency of a spectrogram, and the range of its levels below the largest one.
LOWEST_HZ = 40.0
RANGE_DB = 80.0
#: Duration of a window of a spectrogram, rounded to a power of two of samples.
_WINDOW_S = 0.04
_FEWEST_SAMPLES = 64


@dataclass(frozen=True)
class Channel:
    """One channel of a recording: samples (n,), full scale ±1, and the header of its file."""

    samples: Float32
    info: AudioInfo
    number: int  #: counted from 1


def read_channel(path: Path, segment: Segment, number: int = 1) -> Channel:
    """Return a channel of a recording at the rate of its file; `number` counts from 1.

    Raises AudioError for a file that cannot be read or that lacks the channel.
    """
    state = None
    if path.is_file():
        stat = path.stat()
        state = (stat.st_mtime_ns, stat.st_size)
    return _read_channel(path, segment, number, state)


@lru_cache(maxsize=2)
def _read_channel(path: Path, segment: Segment, number: int, state: object) -> Channel:
    """Return a channel of a file whose time of change and size are `state`.

    The last channels stay in memory, because a browser requests a sound in several parts.
    """
    info = inspect_audio(path, segment)
    settings = AudioSettings(sample_rate_hz=info.sample_rate_hz, microphone=number)
    return Channel(read_audio(path, settings, segment).samples, info, number)


def wav_bytes(channel: Channel) -> bytes:
    """Return a channel as a 24-bit WAV, which browsers play. Samples beyond ±1 are clipped."""
    samples = np.nan_to_num(channel.samples, posinf=1.0, neginf=-1.0).clip(-1, 1)
    return pcm24_bytes(samples, channel.info.sample_rate_hz)


def level_dbfs(samples: Float32) -> float | None:
    """Return the peak level of samples (n,) in dB of full scale; None for silence or no samples."""
    peak = float(np.abs(np.nan_to_num(samples)).max(initial=0))
    return 20 * float(np.log10(peak)) if peak else None


def peaks(samples: Float32, count: int = PEAKS) -> np.ndarray:
    """Return the smallest and the largest sample (2, m) in each of m <= `count` equal parts.

    >>> import numpy as np
    >>> from ajgdata.browse.sounds import peaks
    >>> peaks(np.array([0, 1, -1, 0.5], np.float32), count=2).tolist()
    [[0.0, -1.0], [1.0, 0.5]]
    """
    if not len(samples):
        return np.empty((2, 0))
    samples = np.nan_to_num(samples)
    starts = np.unique(np.linspace(0, len(samples), count, endpoint=False).astype(int))
    return np.stack([np.minimum.reduceat(samples, starts), np.maximum.reduceat(samples, starts)])


@dataclass(frozen=True)
class Spectrogram:
    """Levels (rows, columns) as bytes, 255 for the largest level and 0 for RANGE_DB below it.

    The rows have logarithmic frequencies from `low_hz`, which is the first row, to `high_hz`; the
    columns are equal steps of time over the complete sound.
    """

    levels: np.ndarray
    low_hz: float
    high_hz: float


def spectrogram(samples: Float32, sample_rate_hz: int) -> Spectrogram:
    """Return the spectrogram of samples (n,), also of a sound that is shorter than a window.

    There are up to COLUMNS windows; a long sound has gaps between them. Each row has the largest
    level of its frequencies, or an interpolated level if it is narrower than a bin.
    """
    samples = np.nan_to_num(samples)
    window = max(_FEWEST_SAMPLES, 2 ** round(np.log2(_WINDOW_S * sample_rate_hz)))
    padded = np.pad(samples, (0, max(0, window - len(samples))))
    last = len(padded) - window
    count = max(1, min(COLUMNS, 1 + last // (window // 8)))
    starts = np.linspace(0, last, count).astype(int)
    frames = padded[starts[:, np.newaxis] + np.arange(window)]
    weights = periodic_window("hann", window).astype(np.float32)
    size = np.abs(scipy.fft.rfft(frames * weights, axis=1))  # (columns, bins)
    bin_hz = sample_rate_hz / window
    high_hz = sample_rate_hz / 2
    low_hz = min(max(LOWEST_HZ, 2 * bin_hz), high_hz / 2)
    edges_hz = np.geomspace(low_hz, high_hz, ROWS + 1)
    rows = np.empty((ROWS, count), np.float32)
    for row, (low, high) in enumerate(pairwise(edges_hz.tolist())):
        first = int(np.ceil(low / bin_hz))
        after = int(np.ceil(high / bin_hz))
        if first < after:
            rows[row] = size[:, first:after].max(axis=1)
        else:
            position = np.sqrt(low * high) / bin_hz
            below = int(position)
            share = position - below
            rows[row] = (1 - share) * size[:, below] + share * size[:, below + 1]
    largest = float(rows.max()) or 1.0
    with np.errstate(divide="ignore"):
        level_db = 20 * np.log10(rows / largest)
    shares = np.clip(1 + level_db / RANGE_DB, 0, 1)
    return Spectrogram(np.rint(255 * shares).astype(np.uint8), low_hz, high_hz)
