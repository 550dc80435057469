"""Detection of a changed gripper from recordings of the empty gripper, without a model.

Each reference has a score: how far its spectrum, compressed by asinh as in the CNN, lies from the
references of day 1, in standard deviations of theirs (rms over the bins). Those of day 1 are scored
by the others (leave one out). The alarm is raised when the last m references all score more than
the j-th largest score of the n of day 1. While nothing changes, n + m scores have no order but that
of chance, and the m newest are among the m + j - 1 largest with the probability

    C(m + j - 1, m) / C(n + m, m),

whatever the distribution of the scores (Gibbons & Chakraborti, Nonparametric Statistical Inference,
section 2.11: exceedances). j is the largest that keeps this within FALSE_ALARM. It holds for
references that can stand for one another: if those of day 1 are all of one hour, an alarm may mean
only that it is another one.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ajgdata.types import NotPossibleError

Float64 = NDArray[np.float64]
#: Share of false alarms that is allowed, at a given moment.
FALSE_ALARM = 0.01
#: References that must agree to an alarm (m).
IN_A_ROW = 3
#: References of day 1 that an alarm needs: 1 / C(7 + 3, 3) is the first below FALSE_ALARM.
REFERENCES_NEEDED = 7
#: Compressed bins that vary by less, which float32 rounds away, never change.
STILL = 1e-6


class DriftWatch:
    """Watches references, recordings of the empty gripper, for a change of the gripper.

    `references` (r, f) are features of day 1, from the hours and days that the training is from.
    Raises NotPossibleError for too few references, with how many are missing.

    >>> watch = DriftWatch(np.random.default_rng(0).uniform(1, 2, (20, 50)))
    >>> round(watch.false_alarm, 4)
    0.0056
    >>> [watch.observe(np.full(50, value)) > 1 for value in (1.5, 9.0, 9.0, 9.0)]
    [False, False, False, True]
    """

    false_alarm: float  #: probability that references of an unchanged gripper raise the alarm
    limit: float  #: score that references of a changed gripper exceed, in standard deviations

    def __init__(self, references: ArrayLike) -> None:
        known = np.asarray(references, np.float64)
        if known.ndim != 2 or not np.isfinite(known).all():
            raise ValueError("references must be finite features of the shape (r, f)")
        if (missing := REFERENCES_NEEDED - len(known)) > 0:
            raise NotPossibleError(
                f"{len(known)} references of day 1 are too few for a false-alarm rate of "
                f"{FALSE_ALARM:g}: record {missing} more of the empty gripper"
            )
        self._scale = float(np.abs(known).mean()) or 1.0
        compressed = np.arcsinh(known / self._scale)
        self._mean, self._sd = _mean_and_sd(compressed)
        scores = np.sort([_left_out(compressed, row) for row in range(len(known))])
        ways = math.comb(len(known) + IN_A_ROW, IN_A_ROW)
        rates = [math.comb(IN_A_ROW + j - 1, IN_A_ROW) / ways for j in range(1, len(known) + 1)]
        place = sum(rate <= FALSE_ALARM for rate in rates)  # the largest j, rates increase
        self.false_alarm = rates[place - 1]
        # Features have the digits of float32: below that references that are all alike differ.
        self.limit = max(float(scores[-place]), float(np.finfo(np.float32).eps))
        self._last: deque[float] = deque(maxlen=IN_A_ROW)

    def score(self, features: ArrayLike) -> Float64:
        """Return how far features (…, f) lie from day 1, (…,), in its standard deviations."""
        compressed = np.arcsinh(np.asarray(features, np.float64) / self._scale)
        return _rms((compressed - self._mean) / self._sd)

    def observe(self, feature: ArrayLike) -> float:
        """Take in a new reference, a feature (f,); return the least score of the last IN_A_ROW
        over the limit. Above 1 the gripper has changed.

        Before there are as many it is 1 at most. Raises ValueError for a feature of another length
        or that is not finite; it then counts as never taken.
        """
        new = np.asarray(feature, np.float64)
        if new.shape != self._mean.shape or not np.isfinite(new).all():
            raise ValueError(f"a reference must be {len(self._mean)} finite numbers, as day 1's")
        self._last.append(float(self.score(new)) / self.limit)
        least = min(self._last)
        return least if len(self._last) == IN_A_ROW else min(least, 1.0)


def _left_out(compressed: Float64, row: int) -> float:
    """Return the score of one of `compressed` (r, f) by the others."""
    mean, sd = _mean_and_sd(np.delete(compressed, row, axis=0))
    return float(_rms((compressed[row] - mean) / sd))


def _mean_and_sd(compressed: Float64) -> tuple[Float64, Float64]:
    """Return mean and standard deviation (f,) of each bin of (r, f); 1 where it never changes."""
    sd = compressed.std(axis=0, ddof=1)
    return compressed.mean(axis=0), np.where(sd > STILL, sd, 1.0)


def _rms(values: Float64) -> Float64:
    return np.asarray(np.sqrt(np.mean(np.square(values), axis=-1)))
