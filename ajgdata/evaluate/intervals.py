"""95 % intervals over grasps by cluster bootstrap: all recordings of a grasp are drawn together.

Grasps are independent, but recordings of one grasp are not. Each resample draws as many grasps as
there are, with replacement, and computes the reported statistic again (Davison & Hinkley 1997,
Bootstrap Methods and their Application, 3.8). The interval does not contain the effect of other
training grasps.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.special import betaincinv

from ajgdata.evaluate.agreement import UNDEFINED, Interval
from ajgdata.evaluate.metrics import length, wrapped
from ajgdata.types import Kind

#: Share of intervals that contain the true value, if the assumptions hold.
CONFIDENCE = 0.95
RESAMPLES = 2000
#: Smallest number of grasps for a bootstrap interval. For normal errors, the coverage of the
#: interval is 82 % with 10 grasps, 87 % with 16, 91 % with 24, and 93 to 95 % with 80 or more
#: (tests/unit/test_intervals.py).
MIN_GRASPS = 10
#: Largest number of elements, resamples times grasps, that are in memory at the same time.
_BLOCK = 2_000_000
#: Values whose difference is a smaller share of the largest value are equal except for rounding.
ROUNDING = 1e-9


def metric_interval(
    y_true: np.ndarray,
    y_pred: np.ndarray,
    fold: np.ndarray,
    grasp: np.ndarray,
    *,
    kind: Kind,
    period: float | None = None,
    part: np.ndarray | None = None,
    seed: int = 0,
) -> Interval:
    """Return the 95 % interval over grasps of the mean over folds of RMSE or accuracy.

    All arrays are (n,), one element per prediction: truth, prediction, number of the fold, and
    grasp. Truth and prediction of a vector are (n, k). The RMSE of a regression is in the unit of
    the target, an accuracy between 0 and 1. The interval is that of a cluster bootstrap (see the
    head of `ajgdata/evaluate/intervals.py`). With a `period`, the targets y and y + period are
    equal.

    If several folds predict a grasp, because it is in no training part, a resample draws it for all
    of them together. With `part` (n,), the metric of a fold is over all parts, each weighted by its
    number of recordings in the complete resample (see `crossval.overall`).

    A bootstrap interval is not possible with fewer than `MIN_GRASPS` grasps, or if all predictions
    are correct, or all are wrong, because all resamples are then equal. The interval of an accuracy
    is then that of Clopper and Pearson (1934) with grasps as trials; the interval of an RMSE is
    undefined.

    >>> import ajgdata
    >>> import numpy as np
    >>> y, fold, grasp = np.repeat(["a", "b"], 20), np.tile([0, 1], 20), np.arange(40)
    >>> low, high = ajgdata.metric_interval(y, y, fold, grasp, kind="classification")
    >>> f"{low:.3f} {high:.0f}"  # 40 of 40: 0.025 ** (1 / 40)
    '0.912 1'
    """
    if kind == "regression":
        difference = wrapped(np.asarray(y_pred, float) - np.asarray(y_true, float), period)
        loss = np.square(length(difference))
    else:
        loss = np.asarray(y_pred == y_true, float)
    is_share = kind == "classification"
    return mean_interval(loss, grasp, fold, part, root=not is_share, is_share=is_share, seed=seed)


def mean_interval(
    value: np.ndarray,
    grasp: np.ndarray,
    fold: np.ndarray | None = None,
    part: np.ndarray | None = None,
    *,
    root: bool = False,
    is_share: bool = False,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> Interval:
    """Return the 95 % interval over grasps of the mean over folds of the mean of `value` (n,).

    With `root`, the square root of the mean of a fold is used. `is_share` means that values are 0
    or 1, so that an exact interval is possible (see `metric_interval`, also for the arrays).
    """
    names, member = np.unique(grasp, return_inverse=True)
    sums = _sums(value, member, fold, part)
    interval = UNDEFINED
    if len(names) >= MIN_GRASPS:
        blocks = resampled_counts(len(names), resamples, seed)
        resampled = [_statistic(drawn, sums, root) for drawn in blocks]
        interval = spread_interval(np.concatenate(resampled))
    if interval.is_defined or not is_share:
        return interval
    (share,) = _statistic(np.ones((1, len(names))), sums, root)
    return clopper_pearson(share * len(names), len(names))


class _Sums(NamedTuple):
    """Sums over the predictions of each grasp."""

    totals: np.ndarray  #: sum of the values (grasps, parts, folds)
    counts: np.ndarray  #: number of predictions (grasps, parts, folds)
    recordings: np.ndarray  #: number of recordings (grasps, parts)


def _sums(
    value: np.ndarray, member: np.ndarray, fold: np.ndarray | None, part: np.ndarray | None
) -> _Sums:
    """Return the sums over the predictions of each grasp, which are numbered by `member` (n,).

    The recordings of a grasp are all predicted by one fold, or all by each of several folds.
    """
    fold_number = np.zeros_like(member)
    if fold is not None:
        fold_number = np.unique(fold, return_inverse=True)[1]
    part_number = np.zeros_like(member)
    if part is not None:
        part_number = np.unique(part, return_inverse=True)[1]
    shape = (member.max() + 1, part_number.max() + 1, fold_number.max() + 1)
    totals = np.zeros(shape)
    np.add.at(totals, (member, part_number, fold_number), value)
    counts = np.zeros(shape)
    np.add.at(counts, (member, part_number, fold_number), 1.0)
    return _Sums(totals, counts, recordings=counts.max(axis=2))


def _statistic(drawn: np.ndarray, sums: _Sums, root: bool) -> np.ndarray:
    """Return the mean over folds (resamples,) if grasp g counts drawn[:, g] times.

    `drawn` (resamples, grasps). A fold has no value in a resample that has no grasp of one of its
    parts; the mean is over the other folds.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.tensordot(drawn, sums.totals, 1) / np.tensordot(drawn, sums.counts, 1)
        weight = drawn @ sums.recordings
        per_fold = np.einsum("rp,rpf->rf", weight, mean) / weight.sum(axis=1, keepdims=True)
    if root:
        per_fold = np.sqrt(per_fold)
    known = np.isfinite(per_fold)
    with np.errstate(invalid="ignore"):
        return np.where(known, per_fold, 0).sum(axis=1) / known.sum(axis=1)


def resampled_counts(
    grasps: int, resamples: int = RESAMPLES, seed: int = 0
) -> Iterator[np.ndarray]:
    """Yield blocks (resamples of the block, grasps) of the number of times a grasp is drawn."""
    generator = np.random.default_rng(seed)
    size = max(1, _BLOCK // grasps)
    for start in range(0, resamples, size):
        counts = []
        for _ in range(min(size, resamples - start)):
            drawn = generator.integers(0, grasps, grasps)
            counts.append(np.bincount(drawn, minlength=grasps))
        yield np.array(counts, float)


def spread_interval(resampled: np.ndarray) -> Interval:
    """Return the interval of the central 95 % of resampled statistics (resamples,).

    Resamples without a value (NaN) do not count. The interval is undefined if all are equal.
    """
    known = resampled[np.isfinite(resampled)]
    if not len(known) or np.ptp(known) <= ROUNDING * np.abs(known).max():
        return UNDEFINED
    low, high = np.percentile(known, [50 * (1 - CONFIDENCE), 50 * (1 + CONFIDENCE)])
    return Interval(float(low), float(high))


def clopper_pearson(successes: float, trials: int) -> Interval:
    """Return the exact 95 % interval of the probability of a success (Clopper & Pearson 1934)."""
    tail = (1 - CONFIDENCE) / 2
    low = 0.0
    if successes > 0:
        low = float(betaincinv(successes, trials - successes + 1, tail))
    high = 1.0
    if successes < trials:
        high = float(betaincinv(successes + 1, trials - successes, 1 - tail))
    return Interval(low, high)


def exact_lower_bound(successes: float, trials: int) -> float:
    """Return the exact one-sided lower 95 % bound of the probability of a success.

    >>> from ajgdata.evaluate.intervals import exact_lower_bound
    >>> f"{exact_lower_bound(39, 39):.3f}"  # 0.05 ** (1 / 39)
    '0.926'
    """
    if successes <= 0:
        return 0.0
    return float(betaincinv(successes, trials - successes + 1, 1 - CONFIDENCE))
