"""Which draws are like the paper, and what they have in common: approximate Bayesian computation.

Rejection (Pritchard et al. 1999, Mol. Biol. Evol. 16, 1791): of grippers drawn from what is not
known (the prior) those are kept whose figures lie within a tolerance of the paper's; they are a
sample of what is not known once the paper is (the posterior).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import kstest

from ajgdata.draws.rows import Sense

Real = NDArray[np.float64]
#: Tolerance of a row in standard deviations over its folds, of the middle draw.
SDS = 2.0
#: Standard deviation of an even distribution of width 1.
EVEN_SD = 12**-0.5


class Shift(NamedTuple):
    """How a parameter differs among the kept draws, (d,): mean place less that of the range's
    middle in standard deviations of the prior, standard deviation over the prior's, and p of the
    Kolmogorov-Smirnov test against the prior, times the number of parameters (Bonferroni)."""

    mean: Real
    spread: Real
    p: Real


def tolerance_of(sd: Real, step: Real, to_chance: float = np.nan) -> float:
    """Return SDS times the median of `sd` (n,), and at least the median of what one recording
    changes, `step` (n,), but no more than half of `to_chance`, the distance from the paper to a
    model that ignores its input; NaN where neither is known."""
    known = [
        factor * float(np.nanmedian(one))
        for factor, one in ((SDS, sd), (1.0, step))
        if np.isfinite(one).any()
    ]
    if not known or max(known) <= 0:
        return float("nan")
    return float(np.fmin(max(known), 0.5 * to_chance if to_chance else np.nan))


def misses(values: Real, target: float, tolerance: float, sense: Sense = "near") -> Real:
    """Return by how many tolerances values (n,) miss the target; infinity for those missing.

    Of "at least" and "at most" nothing is missed on the right side.
    """
    away = values - target
    away = {"near": np.abs(away), "at least": np.maximum(0, -away)}.get(sense, np.maximum(0, away))
    return np.where(np.isfinite(values), away / tolerance, np.inf)


def together(missed: Sequence[Real], figure: Sequence[str]) -> Real:
    """Return the greatest miss (n,) over all figures of the paper, each by the row nearest to it.

    `missed` (n,) each, of rows whose `figure` may be one: of two readings of what a figure means
    one can be right.
    """
    nearest: dict[str, Real] = {}
    for one, name in zip(missed, figure, strict=True):
        nearest[name] = np.minimum(nearest[name], one) if name in nearest else one
    return np.max(np.stack(list(nearest.values())), axis=0)


def shift_of(places: Real, kept: NDArray[np.bool_]) -> Shift:
    """Return how the kept of the draws at `places` (n, d) differ from the prior, even in [0, 1]."""
    some = places[kept]
    p = np.array([kstest(column, "uniform").pvalue for column in some.T])
    return Shift(
        (some.mean(axis=0) - 0.5) / EVEN_SD,
        some.std(axis=0, ddof=1) / EVEN_SD,
        np.minimum(1.0, p * some.shape[1]),
    )
