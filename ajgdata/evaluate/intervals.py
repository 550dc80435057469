"""95 % intervals over grasps by cluster bootstrap: all recordings of a grasp are drawn together.

Grasps, not recordings, are independent. Each resample draws as many grasps as there are, with
replacement, and computes the reported statistic again (Davison & Hinkley 1997, Bootstrap Methods
and their Application, 3.8). The interval does not contain the effect of other training grasps.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.special import betaincinv

from ajgdata.evaluate.agreement import UNDEFINED, Interval
from ajgdata.evaluate.metrics import wrapped
from ajgdata.types import Kind

#: Share of such intervals that contain the true value, if the assumptions hold.
CONFIDENCE = 0.95
RESAMPLES = 2000
#: With fewer grasps resamples say too little. The coverage for normal errors is 82 % of 10 grasps,
#: 87 % of 16, 91 % of 24, and 93 to 95 % from 80 on (tests/unit/test_intervals.py).
MIN_GRASPS = 10
#: Numbers that are held at once: blocks of resamples times grasps.
_BLOCK = 2_000_000
#: Values that differ by less than this share of the largest differ by rounding.
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
    grasp. The RMSE of a regression is in the unit of the target, an accuracy between 0 and 1. The
    interval is that of a cluster bootstrap (see the head of `ajgdata/evaluate/intervals.py`).
    `period`: of a target where y and y + period are equal.

    A grasp that several folds predict, because it is in no training part, is drawn once for all of
    them. With `part`, a fold's metric is over all parts, each weighted by its recordings in the
    whole resample (see `crossval.overall`).

    If all predictions are right, or all are wrong, resamples do not differ, and below `MIN_GRASPS`
    they say too little. The interval of an accuracy is then that of Clopper and Pearson (1934) with
    grasps as trials; that of an error is undefined.

    >>> import ajgdata
    >>> import numpy as np
    >>> y, fold, grasp = np.repeat(["a", "b"], 20), np.tile([0, 1], 20), np.arange(40)
    >>> low, high = ajgdata.metric_interval(y, y, fold, grasp, kind="classification")
    >>> f"{low:.3f} {high:.0f}"  # 40 of 40: 0.025 ** (1 / 40)
    '0.912 1'
    """
    if kind == "regression":
        loss = np.square(wrapped(np.asarray(y_pred, float) - np.asarray(y_true, float), period))
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
    """Return the interval of the mean of `value` (n,) over folds; `root`: of its square root.

    `is_share`: values are 0 or 1 (see `metric_interval`).
    """
    names, member = np.unique(grasp, return_inverse=True)
    totals, counts, recordings = _sums(value, member, fold, part)
    interval = UNDEFINED
    if len(names) >= MIN_GRASPS:
        drawn = resampled_counts(len(names), resamples, seed)
        each = [_statistic(block, totals, counts, recordings, root) for block in drawn]
        interval = spread_interval(np.concatenate(each))
    if interval.is_defined or not is_share:
        return interval
    (share,) = _statistic(np.ones((1, len(names))), totals, counts, recordings, root)
    return clopper_pearson(share * len(names), len(names))


def _sums(
    value: np.ndarray, member: np.ndarray, fold: np.ndarray | None, part: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return sums and counts (grasps, parts, folds), and recordings (grasps, parts).

    The recordings of a grasp are all predicted by one fold, or all by each of several.
    """
    fold_of = np.unique(fold, return_inverse=True)[1] if fold is not None else 0 * member
    part_of = np.unique(part, return_inverse=True)[1] if part is not None else 0 * member
    shape = member.max() + 1, part_of.max() + 1, fold_of.max() + 1
    totals, counts = np.zeros(shape), np.zeros(shape)
    np.add.at(totals, (member, part_of, fold_of), value)
    np.add.at(counts, (member, part_of, fold_of), 1.0)
    return totals, counts, counts.max(axis=2)


def _statistic(
    drawn: np.ndarray, totals: np.ndarray, counts: np.ndarray, recordings: np.ndarray, root: bool
) -> np.ndarray:
    """Return the mean over folds (resamples,) if grasp g counts drawn[:, g] times.

    A fold of which no grasp (of some part) was drawn has no value in that resample.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.tensordot(drawn, totals, 1) / np.tensordot(drawn, counts, 1)
        weight = drawn @ recordings
        per_fold = np.einsum("rp,rpf->rf", weight, mean) / weight.sum(axis=1, keepdims=True)
    per_fold = np.sqrt(per_fold) if root else per_fold
    known = np.isfinite(per_fold)
    with np.errstate(invalid="ignore"):
        return np.where(known, per_fold, 0).sum(axis=1) / known.sum(axis=1)


def resampled_counts(
    grasps: int, resamples: int = RESAMPLES, seed: int = 0
) -> Iterator[np.ndarray]:
    """Yield how often each grasp is drawn, as blocks (resamples of the block, grasps)."""
    generator, size = np.random.default_rng(seed), max(1, _BLOCK // grasps)
    for start in range(0, resamples, size):
        rows = (generator.integers(0, grasps, grasps) for _ in range(min(size, resamples - start)))
        yield np.array([np.bincount(row, minlength=grasps) for row in rows], float)


def spread_interval(resampled: np.ndarray) -> Interval:
    """Return the central 95 % of resampled statistics (resamples,); undefined if they are equal.

    Resamples in which the statistic has no value (NaN) do not count.
    """
    known = resampled[np.isfinite(resampled)]
    if not len(known) or np.ptp(known) <= ROUNDING * np.abs(known).max():
        return UNDEFINED
    low, high = np.percentile(known, [50 * (1 - CONFIDENCE), 50 * (1 + CONFIDENCE)])
    return Interval(float(low), float(high))


def clopper_pearson(right: float, trials: int) -> Interval:
    """Return the exact interval of a share of which `right` of `trials` were seen."""
    tail = (1 - CONFIDENCE) / 2
    low = betaincinv(right, trials - right + 1, tail) if right > 0 else 0.0
    high = betaincinv(right + 1, trials - right, 1 - tail) if right < trials else 1.0
    return Interval(float(low), float(high))


def exact_lower_bound(right: float, trials: int) -> float:
    """Return the exact one-sided lower 95 % bound of a share: `right` of `trials` were seen.

    >>> from ajgdata.evaluate.intervals import exact_lower_bound
    >>> f"{exact_lower_bound(39, 39):.3f}"  # 0.05 ** (1 / 39)
    '0.926'
    """
    if right <= 0:
        return 0.0
    return float(betaincinv(right, trials - right + 1, 1 - CONFIDENCE))
