"""Check of the encoding: bytes of floating-point numbers under an integer header.

The upper byte of a float32 of magnitude 2**-20 to 1 is 0x35 to 0x3F, with a sign bit 0xB5 to 0xBF;
the upper two bytes of a float64 are 0x3EB0 to 0x3FEF. As an integer of full scale 1, and without
the upper bit (modulo 1), they are 0.41 to 0.5: positive integers just below 0.5, negative
ones below -0.5. The integers have 8, 16, 24 or 32 bits, so that the upper byte of a number is in
each sample or in every second, fourth or eighth one. Sound is symmetric and crosses zero: in each
of the eight phases, most samples are outside.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ajgdata.store.audio import Remark

#: Upper bytes of numbers of magnitude 2**-20 to 1, modulo 1.
LOWEST_BYTES = 0.41
HIGHEST_BYTES = 0.5
#: Part of the samples in this range. Smaller numbers of a decay are outside, and zeros are ignored.
MIN_PART = 0.9
#: Least root mean square: one sample of eight has at least LOWEST_BYTES, and
#: 0.41 / sqrt(8) = 0.145.
_LEAST_RMS = 0.14
#: Groups of eight successive samples that are examined, from the whole recording.
_GROUPS = 256
_PHASES = 8
#: Fewer samples than this (of 256) prove nothing.
_MIN_SAMPLES = 64


def check_encoding(samples: NDArray[np.float32], rms: float) -> Remark | None:
    """Return an error if the samples (n,) of an integer file are bytes of floating-point numbers.

    `rms` is the largest root mean square of a segment. The recording is unusable, because its
    spectrum is that of noise at full scale.
    """
    if rms < _LEAST_RMS or len(samples) < _PHASES * _MIN_SAMPLES:
        return None
    groups = samples[: len(samples) // _PHASES * _PHASES].reshape(-1, _PHASES)
    selected = groups[:: max(1, len(groups) // _GROUPS)]
    remainder = selected - np.floor(selected)
    nonzero = np.count_nonzero(remainder, axis=0)
    inside = np.count_nonzero((remainder > LOWEST_BYTES) & (remainder < HIGHEST_BYTES), axis=0)
    if not np.any((nonzero >= _MIN_SAMPLES) & (inside >= MIN_PART * nonzero)):
        return None
    problem = (
        "the samples are bytes of floating-point numbers under an integer header: noise at full"
        " scale"
    )
    fix = "export it again from the program that wrote it, as float WAV or 16-bit WAV"
    return Remark("error", "float_bytes", problem, fix)
