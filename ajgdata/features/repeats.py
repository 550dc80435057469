"""Check of repeated blocks: a buffer that a sound card delivers twice.

A microphone has noise, so no stretch of 64 samples occurs twice. A comparison of all pairs of
stretches is slow. Therefore only anchors are compared: samples whose value and predecessor have a
certain hash. Both copies have the same anchors, with equal neighbourhoods of 8 samples.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ajgdata.features.gaps import MIN_BUFFER, MIN_QUANTA, real_step
from ajgdata.store.audio import Remark

#: One of 32 pairs of samples is an anchor: a block of 128 samples has one with a probability of
#: 98 %, a block of 256 samples with 99.97 %.
_ANCHOR_SPACING = 32
#: Odd constant of multiplicative hashing: 2**32 over the golden ratio (Knuth, The Art of Computer
#: Programming 3, 6.4).
_MULTIPLIER = np.uint32(0x9E3779B1)
#: Lags that are compared in full.
_MAX_LAGS = 8
#: Least difference between the sound next to a repeated block and the sound next to its copy, in
#: root mean squares. Independent sound differs by 1.4; periodic sound repeats there as well.
_DIFFERENCE = 0.5
#: Number of lags from which an equal run is periodic sound, which can also end abruptly: these are
#: four equal blocks in succession.
_PERIODS = 3


def check_repeats(samples: NDArray[np.float32], quantum: float) -> Remark | None:
    """Return a warning for a block of samples (n,) that occurs twice in succession.

    A block has MIN_BUFFER samples or more, and sound of MIN_QUANTA times the `quantum` of the
    encoding or more. Periodic sound is not a repeat.
    """
    for lag in _candidate_lags(samples):
        for start, stop in _equal_runs(samples, lag):
            if _is_repeat(samples, start, stop, lag, quantum):
                problem = f"{lag} samples at {start} occur twice in succession: a repeated buffer"
                fix = "record again with larger buffers of the sound card, or set quality to reject"
                return Remark("warning", "repeated_block", problem, fix)
    return None


def _candidate_lags(samples: NDArray[np.float32]) -> list[int]:
    """Return distances between neighbouring anchors with equal neighbourhoods, most frequent
    first."""
    bits = np.ascontiguousarray(samples, np.float32).view(np.uint32)
    if len(bits) < 2 * MIN_BUFFER:
        return []
    hashes = bits[1:] * _MULTIPLIER  # modulo 2**32
    hashes += bits[:-1]
    anchors = np.flatnonzero(hashes[:-6] < np.uint32(2**32 // _ANCHOR_SPACING))
    neighbourhoods = hashes[anchors + 2].astype(np.uint64) << np.uint64(32)
    neighbourhoods |= hashes[anchors + 4] ^ hashes[anchors + 6] * _MULTIPLIER
    ordered = np.sort(neighbourhoods)
    if not np.any(ordered[1:] == ordered[:-1]):
        return []
    order = np.argsort(neighbourhoods, kind="stable")
    distances = np.diff(anchors[order])[ordered[1:] == ordered[:-1]]
    lags, counts = np.unique(distances[distances >= MIN_BUFFER], return_counts=True)
    return [int(lag) for lag in lags[np.argsort(-counts, kind="stable")][:_MAX_LAGS]]


def _equal_runs(samples: NDArray[np.float32], lag: int) -> list[tuple[int, int]]:
    """Return begin and end of runs of at least `lag` samples that equal the samples `lag` later."""
    equal = samples[:-lag] == samples[lag:]
    edges = np.flatnonzero(np.diff(equal, prepend=False, append=False))
    starts = edges[::2]
    stops = edges[1::2]
    is_long = stops - starts >= lag
    return list(zip(starts[is_long].tolist(), stops[is_long].tolist(), strict=True))


def _is_repeat(
    samples: NDArray[np.float32], start: int, stop: int, lag: int, quantum: float
) -> bool:
    """Return True if the equal run has sound, and neither it nor the sound around it is
    periodic."""
    if stop - start >= _PERIODS * lag:
        return False
    block = samples[start:stop]
    if np.ptp(block) < MIN_QUANTA * real_step(samples, quantum):
        return False
    rms = float(np.std(block))
    before = slice(max(0, start - lag), start)
    after = slice(stop, max(stop, min(stop + lag, len(samples) - lag)))
    around = [
        (samples[part], samples[lag:][part]) for part in (before, after) if part.stop > part.start
    ]
    # Next to digital silence, the sound begins or ends: this does not show whether it is periodic.
    differences = [
        float(np.sqrt(np.mean(np.square(earlier - later))))
        for earlier, later in around
        if np.ptp(earlier) > 0 and np.ptp(later) > 0
    ]
    return bool(differences) and min(differences) >= _DIFFERENCE * rms
