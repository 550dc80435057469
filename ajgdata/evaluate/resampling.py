"""Grouped cross-validation several times over, and an interval that knows that repeats overlap.

One split of few recordings says as much of the split as of the model. Repeats of it agree with each
other more than new recordings would, since they share them: the plain standard error over all folds
is far too small. Nadeau & Bengio (2003, Machine Learning 52, 239) add the share of tested to
trained rows to 1/J; Bouckaert & Frank (2004, PAKDD, 3) use it for repeated cross-validation.
"""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
from scipy.stats import t as student

from ajgdata.evaluate import metrics
from ajgdata.evaluate.agreement import UNDEFINED, Interval
from ajgdata.evaluate.crossval import CrossValidation, Predictions, Scores, Tested, deviation
from ajgdata.evaluate.intervals import CONFIDENCE, ROUNDING
from ajgdata.types import NotPossibleError

#: Fewer recordings are split several times, as often as Bouckaert & Frank advise.
SMALL_SET, REPEATS = 100, 10

Repeats = int | Literal["auto"]


def corrected_deviation(variance: float, count: int, test_share: float) -> float:
    """Return the standard deviation of the mean of `count` fold values of that sample variance.

    `test_share` is the number of tested rows over that of trained ones: 1/(k-1) of k folds.
    """
    return math.sqrt((1 / count + test_share) * variance)


def corrected_reach(variance: float, count: int, test_share: float) -> float:
    """Return half the width of the corrected 95 % interval, t of `count` - 1 degrees of freedom."""
    deviations = float(student.ppf((1 + CONFIDENCE) / 2, count - 1))
    return deviations * corrected_deviation(variance, count, test_share)


def corrected_interval(values: Sequence[float], folds: int, metric: str = "") -> Interval:
    """Return the interval of the mean of fold values (repeats * folds,) of a metric.

    It ends at the range of the metric: no share is above 1 or below 0, no error below 0. It is
    undefined if a fold has no value, or if all folds have the same: no deviation is then known.

    >>> from ajgdata.evaluate.resampling import corrected_interval
    >>> low, high = corrected_interval([1.0, 2.0, 3.0, 4.0, 5.0], folds=5)
    >>> f"{low:.3f} {high:.3f}"  # 3 ± 2.776 sqrt((1/5 + 1/4) 2.5)
    '0.055 5.945'
    """
    found = np.asarray(values, float)
    if len(found) < 2 or not np.isfinite(found).all():
        return UNDEFINED
    if np.ptp(found) <= ROUNDING * np.abs(found).max():
        return UNDEFINED
    reach = corrected_reach(float(found.var(ddof=1)), len(found), 1 / (folds - 1))
    least, most = metrics.RANGES.get(metric, (-math.inf, math.inf))
    mean = float(found.mean())
    return Interval(max(mean - reach, least), min(mean + reach, most))


def repeats_of(wanted: Repeats, recordings: int, groups: int, folds: int) -> int:
    """Return how often a task is split: once where each group is a fold, as there is one such
    split."""
    if groups <= folds:
        return 1
    if wanted == "auto":
        return REPEATS if recordings < SMALL_SET else 1
    return wanted


def repeat_seed(seed: int, repeat: int) -> int:
    """Return the seed of a repeat: that of the task for the first."""
    return int(np.random.SeedSequence([seed, repeat]).generate_state(1)[0]) if repeat else seed


def repeated(
    once: Callable[[int], CrossValidation],
    first: CrossValidation,
    repeats: int,
    *,
    seed: int,
    period: float | None = None,
) -> Tested:
    """Return `first` and `repeats` - 1 more cross-validations together, folds numbered on.

    `once(seed)` makes one; a seed whose folds cannot be made is passed over for the next, so that
    there may be fewer. What `first` predicted stands first, in the order of the rows.
    """
    every = [first]
    for number in range(1, 2 * repeats - 1):
        if len(every) < repeats:
            with contextlib.suppress(NotPossibleError):
                every.append(once(repeat_seed(seed, number)))
    scores = [one.scores for one in every]
    folds = scores[0].folds
    told = [one.predictions for one in every]
    joined = {
        key: np.concatenate([getattr(one, key) for one in told])
        for key in ("row", "y_true", "y_pred")
    }
    sure = [one.probability for one in told if one.probability is not None]
    predictions = Predictions(
        **joined,
        fold=np.concatenate([one.fold + n * folds for n, one in enumerate(told)]),
        probability=np.concatenate(sure) if sure else None,
    )
    return Tested(_together(scores, predictions, period), predictions)


def _together(scores: Sequence[Scores], predictions: Predictions, period: float | None) -> Scores:
    first = scores[0]
    per_fold = {
        name: tuple(v for one in scores for v in one.per_fold[name]) for name in first.per_fold
    }
    pooled = metrics.score(predictions.y_true, predictions.y_pred, first.kind, period)
    counts = [one.confusion for one in scores if one.confusion]
    return dataclasses.replace(
        first,
        split="repeated",
        folds=sum(one.folds for one in scores),
        per_fold=per_fold,
        mean={name: float(np.mean(values)) for name, values in per_fold.items()},
        sd={name: deviation(values) for name, values in per_fold.items()},
        pooled=pooled,
        chance={n: float(np.mean([one.chance[n] for one in scores])) for n in first.chance},
        confusion=tuple(map(tuple, np.sum(counts, axis=0).tolist())) if counts else (),
    )
