"""Features of a changed gripper, corrected by empty-gripper references before and after the change.

Warmth makes sound faster by the square root of the absolute temperature, so that all resonances of
a cavity move by one factor: the spectrum is stretched. The factor is computed on the references, as
in monitoring by ultrasound (optimal stretch: Lu & Michaels, Ultrasonics 43 (2005) 717; Croxford et
al., Ultrasonics 50 (2010) 442). The remaining change is treated as a gain per bin, as of a replaced
microphone, and divided out (as cepstral mean subtraction does: Atal, JASA 55 (1974) 1304).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize_scalar

from ajgdata.features.spectrum import normalised
from ajgdata.types import NotPossibleError

Float64 = NDArray[np.float64]
#: Stretches that are searched, as logarithms: 6 % is 35 K; and the first steps between them.
REACH, STEP = 0.06, 0.001
#: A compressed bin that varies by less does not vary: float32 rounds it away.
STILL = 1e-6


@dataclass(frozen=True)
class Change:
    """Change of a gripper: `stretch` is new frequency over old; `gain` (f,) is old level over new,
    after the stretch is undone; `hz` (f,) are the frequencies of the bins."""

    hz: Float64
    stretch: float
    gain: Float64

    def undone(self, features: ArrayLike, normalisation: str = "l1") -> NDArray[np.float32]:
        """Return features (n, f) recorded after the change as they would have been before."""
        restored = self.gain * stretched(features, self.hz, self.stretch)
        return np.array([normalised(one, normalisation) for one in restored], np.float32)


def change(before: ArrayLike, after: ArrayLike, hz: ArrayLike) -> Change:
    """Return the change of a gripper between references `before` (r, f) and `after` (s, f).

    `hz` (f,) are the frequencies of the bins, rising. Raises NotPossibleError for fewer than two
    references before, or none after.
    """
    known, new = np.asarray(before, np.float64), np.asarray(after, np.float64)
    frequency = np.asarray(hz, np.float64)
    if len(known) < 2 or not len(new):
        raise NotPossibleError(
            f"{len(known)} references before and {len(new)} after the change: "
            "two and one are needed; record more of the empty gripper"
        )
    factor = _stretch(known, new.mean(axis=0), frequency)
    old, back = known.mean(axis=0), stretched(new.mean(axis=0), frequency, factor)
    present = (back > 0) & (old > 0)
    return Change(frequency, factor, np.divide(old, back, out=np.ones_like(back), where=present))


def stretched(features: ArrayLike, hz: Float64, factor: float) -> Float64:
    """Return features (…, f) read at `factor` times each frequency, linearly between bins; beyond
    the last bin they stay as it is."""
    values = np.asarray(features, np.float64)
    at = np.interp(hz * factor, hz, np.arange(len(hz)))
    low = np.minimum(at.astype(int), len(hz) - 2)
    share = at - low
    return (1 - share) * values[..., low] + share * values[..., low + 1]


def _stretch(known: Float64, new: Float64, hz: Float64) -> float:
    """Return the factor at which `new` (f,) is nearest to `known` (r, f), compressed by asinh and
    in standard deviations of theirs."""
    scale = float(np.abs(known).mean()) or 1.0
    compressed = np.arcsinh(known / scale)
    mean, sd = compressed.mean(axis=0), compressed.std(axis=0, ddof=1)
    sd = np.where(sd > STILL, sd, 1.0)

    def misfit(logarithm: float) -> float:
        moved = np.arcsinh(stretched(new, hz, float(np.exp(logarithm))) / scale)
        return float(np.mean(np.square((moved - mean) / sd)))

    steps = np.arange(-REACH, REACH + STEP / 2, STEP)
    nearest = float(steps[np.argmin([misfit(step) for step in steps])])
    bounds = (nearest - STEP, nearest + STEP)
    return float(np.exp(minimize_scalar(misfit, bounds=bounds, method="bounded").x))
