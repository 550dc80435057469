"""Check of a constant offset (DC), which adds to the two lowest bins of the spectrum."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ajgdata.features.segments import Segments
from ajgdata.features.share import OFFSET_GAIN, SHARE_LIMIT, may_exceed, share
from ajgdata.store.audio import Remark

#: An offset is constant: it exceeds the median deviation of the segments' means by this factor.
#: Without an offset, the median of 20 independent means has a standard error of 0.4 deviations.
_STEADINESS = 3
#: Tolerance of a quick estimate of the offset, the mean of all segments.
_ROUGHNESS = 2


def check_offset(
    samples: NDArray[np.float32], parts: Segments, sample_rate_hz: float
) -> Remark | None:
    """Return a warning if an offset has more than SHARE_LIMIT of the spectrum.

    `samples` (n,) have the segments `parts`. Low-frequency sound is not an offset, because its mean
    varies from segment to segment.
    """
    if not len(parts.rms):
        return None
    rough = abs(parts.mean)
    if not may_exceed(OFFSET_GAIN * _ROUGHNESS * rough, parts.mean_rms - rough):
        return None
    means = parts.means.mean(axis=1, dtype=np.float64)
    middle = len(means) // 2
    offset = float(np.sort(means)[middle])  # np.median takes four times as long
    spread = float(np.sort(np.abs(means - offset))[middle])
    if abs(offset) <= _STEADINESS * spread:
        return None
    variance = np.square(parts.rms, dtype=np.float64) - offset**2
    mean_rms = float(np.sqrt(np.maximum(variance, 0)).mean())
    component = OFFSET_GAIN * abs(offset)
    if not may_exceed(component, mean_rms):
        return None
    part = share(component, samples - np.float32(offset), sample_rate_hz)
    if part <= SHARE_LIMIT:
        return None
    problem = f"constant offset of {offset:.3g} of full scale: {100 * part:.0f} % of the spectrum"
    fix = (
        "set features.band_hz so that it excludes bins 0 and 1, for example [33, 22050] for "
        "window 2048 at 44.1 kHz, or high-pass the recordings and import them again"
    )
    return Remark("warning", "offset", problem, fix)
