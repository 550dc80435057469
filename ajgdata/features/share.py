"""Share of a steady component in the paper's spectrum: magnitudes, summed over time, 1-norm.

A frame has N samples, weighted by a periodic Hann window w, with sum_j w[j] = N / 2.

- An offset c adds c N / 2 to bin 0 and c N / 4 to bin 1, and nothing to other bins: 3 c N / 4.
- A line of amplitude A adds A N / 4 to its bin and A N / 8 to each neighbour: A N / 2. Between two
  bins, the sum is 2 % larger.
- Other sound of root mean square s adds at least sqrt(3 / 16) N s = 0.433 N s, because a 1-norm is
  at least the 2-norm, and Parseval's sum is N sum_j w[j]^2 s^2 / 2 with sum_j w[j]^2 = 3 N / 8.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ajgdata.features.spectrum import spectrum
from ajgdata.types import FeatureSettings

#: Largest accepted share. A share of 0.05 moves a normalised spectrum by up to 0.1 in the 1-norm.
#: Spectra of two grasps of one object differ by 0.10 or more (5th percentile of 192 pairs, spheres
#: of 30 mm, simulated; median 0.14), so that a larger component is like another object.
SHARE_LIMIT = 0.05
OFFSET_GAIN = 3 / 4
LINE_GAIN = 1 / 2
#: Least 1-norm of sound of root mean square 1, per sample of the frame.
LEAST_GAIN = math.sqrt(3 / 16)
_PAPER_WINDOW = 2048


def may_exceed(component: float, mean_rms: float) -> bool:
    """Return True if a component may have a larger share than SHARE_LIMIT.

    `component` is gain times amplitude; `mean_rms` is the mean over time of the root mean square of
    all other sound. This is a cheap necessary condition.
    """
    return component * (1 - SHARE_LIMIT) > SHARE_LIMIT * LEAST_GAIN * mean_rms


def share(component: float, other: NDArray[np.float32], sample_rate_hz: float) -> float:
    """Return the share of a component in the spectrum, 0 to 1.

    `component` is gain times amplitude, `other` (n,) are the samples without the component.
    """
    window = min(_PAPER_WINDOW, len(other))
    settings = FeatureSettings(window=window, hop=window // 2, normalisation="none")
    frames = 1 + (len(other) - window) // settings.hop
    norm = float(spectrum(other, sample_rate_hz, settings).sum()) / (frames * window)
    return component / (component + norm)
