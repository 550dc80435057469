"""Has the gripper changed since its model was trained? Recordings of nothing tell, without a model.

Each reference has a score: how far its spectrum, compressed by asinh as in the CNN, lies from the
references of day 1, in standard deviations of theirs (rms over the bins). Those of day 1 are scored
by the others (leave one out). The alarm is raised when the last m references all score more than
the j-th largest score of the n of day 1. While nothing changes, n + m scores have no order but that
of chance, and the m newest are among the m + j - 1 largest with the probability

    C(m + j - 1, m) / C(n + m, m),

whatever the distribution of the scores (Gibbons & Chakraborti, Nonparametric Statistical Inference,
section 2.11: exceedances). j is the largest that keeps this within the false alarms that are
allowed. It holds for references that can stand for one another: if those of day 1 are all of one
hour, an alarm may mean only that it is another one.
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
#: More in a row would be a late alarm.
MOST_IN_A_ROW = 3
#: Each is scored by the others, of which a standard deviation needs two.
FEWEST = 3
#: Compressed bins that vary by less, which float32 rounds away, never change.
STILL = 1e-6


class DriftWatch:
    """Watches references, recordings of the empty gripper, for a change of the gripper.

    `references` (r, f) are features of day 1, from the hours and days that the training is from.
    `false_alarm` is the probability, at most, that references of an unchanged gripper raise the
    alarm at a given moment; `in_a_row` of them must agree to (default: as few as `references`
    allow, at most 3). Raises NotPossibleError for too few references, with how many are missing.

    >>> watch = DriftWatch(np.random.default_rng(0).uniform(1, 2, (20, 50)))
    >>> watch.in_a_row, round(watch.false_alarm, 4)
    (2, 0.0043)
    >>> watch.observe(np.full(50, 1.5)) > 1, watch.observe(np.full(50, 1.5)) > 1
    (False, False)
    >>> watch.observe(np.full(50, 9.0)) > 1, watch.observe(np.full(50, 9.0)) > 1
    (False, True)
    """

    false_alarm: float  #: that probability as it is kept, `false_alarm` or less
    in_a_row: int
    limit: float  #: score that references of a changed gripper exceed, in standard deviations

    def __init__(
        self, references: ArrayLike, false_alarm: float = FALSE_ALARM, in_a_row: int | None = None
    ) -> None:
        known = np.asarray(references, np.float64)
        if known.ndim != 2 or not np.isfinite(known).all():
            raise ValueError("references must be finite features of the shape (r, f)")
        if not 0 < false_alarm < 1:
            raise ValueError(f"false_alarm {false_alarm:g} must lie between 0 and 1")
        if in_a_row is None:
            in_a_row = _fewest(len(known), false_alarm)
        if (missing := references_needed(false_alarm, in_a_row) - len(known)) > 0:
            raise NotPossibleError(
                f"{len(known)} references of day 1 are too few for a false-alarm rate of "
                f"{false_alarm:g}: record {missing} more of the empty gripper, or allow more"
            )
        self.in_a_row = in_a_row
        self._scale = float(np.abs(known).mean()) or 1.0
        compressed = np.arcsinh(known / self._scale)
        self._mean, self._sd = _mean_and_sd(compressed)
        scores = np.sort([_left_out(compressed, row) for row in range(len(known))])
        place, self.false_alarm = _place(len(known), in_a_row, false_alarm)
        # Features have the digits of float32: below that references that are all alike differ.
        self.limit = max(float(scores[-place]), float(np.finfo(np.float32).eps))
        self._last: deque[float] = deque(maxlen=in_a_row)

    def score(self, features: ArrayLike) -> Float64:
        """Return how far features (…, f) lie from day 1, (…,), in its standard deviations."""
        compressed = np.arcsinh(np.asarray(features, np.float64) / self._scale)
        return _rms((compressed - self._mean) / self._sd)

    def observe(self, feature: ArrayLike) -> float:
        """Take in a new reference, a feature (f,); return the least score of the last `in_a_row`
        over the limit. Above 1 the gripper has changed.

        Before there are as many it is 1 at most. Raises ValueError for a feature of another length
        or that is not finite; it then counts as never taken.
        """
        new = np.asarray(feature, np.float64)
        if new.shape != self._mean.shape or not np.isfinite(new).all():
            raise ValueError(
                f"a reference must be {len(self._mean)} finite numbers, as those of day 1 are"
            )
        self._last.append(float(self.score(new)) / self.limit)
        least = min(self._last)
        return least if len(self._last) == self.in_a_row else min(least, 1.0)


def references_needed(false_alarm: float, in_a_row: int = MOST_IN_A_ROW) -> int:
    """Return how many references of day 1 allow an alarm of `in_a_row` at this rate.

    >>> references_needed(0.01, 1), references_needed(0.01, 2), references_needed(0.01, 3)
    (99, 13, 7)
    """
    if in_a_row < 1:
        raise ValueError(f"in_a_row {in_a_row} must be 1 or more")
    needed = FEWEST
    while _place(needed, in_a_row, false_alarm)[0] < 1:
        needed += 1
    return needed


def _fewest(references: int, false_alarm: float) -> int:
    """Return the fewest in a row, MOST_IN_A_ROW at most, that this many references allow."""
    enough = (
        number
        for number in range(1, MOST_IN_A_ROW)
        if references >= references_needed(false_alarm, number)
    )
    return next(enough, MOST_IN_A_ROW)


def _place(references: int, in_a_row: int, false_alarm: float) -> tuple[int, float]:
    """Return the largest j that keeps the rate of false alarms (0: none does), and that rate."""
    ways = math.comb(references + in_a_row, in_a_row)
    place, rate = 0, 0.0
    while (
        place < references and (more := math.comb(in_a_row + place, in_a_row) / ways) <= false_alarm
    ):
        place, rate = place + 1, more
    return place, rate


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
