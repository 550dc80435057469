"""Check of gaps: runs of exact zeros inside the sound, which dropped buffers leave."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ajgdata.store.audio import Remark

#: Buffers of sound cards have 64 samples or more.
MIN_BUFFER = 64
#: Sound on both sides of a gap, in quanta. A tone of 20 Hz that is 8 quanta high 64 samples after a
#: zero crossing has an amplitude of 44 quanta, and rounds to zero for 8 samples only.
MIN_QUANTA = 8


def check_gaps(samples: NDArray[np.float32], quantum: float) -> Remark | None:
    """Return a warning for runs of zeros in samples (n,) that begin and end in the sound.

    `quantum` is the step of the encoding. Silence at the beginning or end is not a gap, and neither
    is silence into which the sound decays or fades.
    """
    zero = samples == 0
    if np.count_nonzero(zero) < MIN_BUFFER:
        return None
    edges = np.flatnonzero(zero[1:] != zero[:-1]) + 1
    starts = edges[~zero[edges - 1]]
    stops = edges[zero[edges - 1]]
    stops = stops[stops > (starts[0] if len(starts) else len(samples))]
    starts = starts[: len(stops)]  # a run until the end has no stop
    is_long = stops - starts >= MIN_BUFFER
    if not is_long.any():
        return None
    step = real_step(samples, quantum)
    gaps = [
        (start, stop)
        for start, stop in zip(starts[is_long].tolist(), stops[is_long].tolist(), strict=True)
        if _is_loud(samples[max(0, start - MIN_BUFFER) : start], step)
        and _is_loud(samples[stop : stop + MIN_BUFFER], step)
    ]
    if not gaps:
        return None
    start, stop = gaps[0]
    count = f"{len(gaps)} gaps" if len(gaps) > 1 else "a gap"
    problem = f"{count} of zeros inside the sound, the first of {stop - start} samples at {start}"
    fix = "record again with larger buffers of the sound card, or set quality to reject"
    return Remark("warning", "gap", problem, fix)


def real_step(samples: NDArray[np.float32], quantum: float) -> float:
    """Return the step of samples (n,): `quantum`, or more if coarser numbers were converted."""
    magnitude = np.abs(samples)
    return max(quantum, float(magnitude.min(where=magnitude > 0, initial=np.inf)))


def _is_loud(samples: NDArray[np.float32], step: float) -> bool:
    """Return True if samples (n,) have sound, as opposed to rounding noise."""
    return bool(np.abs(samples).max() >= MIN_QUANTA * step)
