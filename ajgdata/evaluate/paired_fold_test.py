"""Did a change make a difference? Folds of two cross-validations -> an interval and a verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ajgdata.evaluate.resampling import corrected_reach
from ajgdata.types import NotPossibleError

Expected = Literal["better", "worse"]
Verdict = Literal["supported", "refuted", "not supported"]


@dataclass(frozen=True)
class FoldDifference:
    """By how much the second of two is better than the first, in the metric's unit: mean over
    folds, and the ends of its 95 % interval."""

    gain: float
    low: float
    high: float

    def verdict(self, expected: Expected = "better") -> Verdict:
        """Return the verdict on the hypothesis that the second is better (or worse): refuted where
        it is the opposite beyond the interval, not supported where neither can be told."""
        better, worse = self.low > 0, self.high < 0
        if not (better or worse):
            return "not supported"
        return "supported" if better == (expected == "better") else "refuted"


def paired_fold_test(
    before: Sequence[float], after: Sequence[float], *, lower_is_better: bool, paired: bool
) -> FoldDifference:
    """Compare fold values (k,) of two cross-validations with as many folds.

    `paired`: fold i of both tests the same groups. Folds share most of their training rows, so
    that their plain standard error is too small: the variance of the mean difference of k folds is
    taken as (1/k + 1/(k-1)) s², its tests being 1/(k-1) of its training rows, with k-1 degrees of
    freedom (Nadeau & Bengio 2003, Machine Learning 52, 239). Unpaired, s² is the sum of both.

    Raises ValueError for other than two or more finite values of each, as many of both.
    """
    first, second = np.asarray(before, float), np.asarray(after, float)
    folds = len(first)
    if first.shape != second.shape or first.ndim != 1 or folds < 2:
        raise ValueError(f"need as many folds of both, two or more: {first.shape}, {second.shape}")
    if not (np.isfinite(first).all() and np.isfinite(second).all()):
        raise NotPossibleError("a fold has no value: give folds more groups")
    sign = -1.0 if lower_is_better else 1.0
    gains = sign * (second - first)
    variance = gains.var(ddof=1) if paired else first.var(ddof=1) + second.var(ddof=1)
    reach = corrected_reach(float(variance), folds, 1 / (folds - 1))
    gain = float(gains.mean())
    return FoldDifference(gain, gain - reach, gain + reach)
