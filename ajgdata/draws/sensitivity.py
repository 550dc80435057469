"""Which parameters move a row: an emulator of the draws, its error, and Sobol indices on it."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import sobol_indices, spearmanr, uniform
from scipy.stats import t as student

Real = NDArray[np.float64]
Function = Callable[[Real], Real]
FOLDS, TREES = 5, 60
#: Rows of one of the two matrices of Saltelli's scheme, a power of two for Sobol's sequence; and
#: how often it is drawn: what the sampling leaves open shows in the scatter.
POINTS, TIMES, CONFIDENCE = 512, 6, 0.95


class Emulator(NamedTuple):
    """What predicts a row (n,) from places in the ranges (n, d) in [0, 1]; `r2` is of draws that
    it was not fitted to, 1 at best, 0 or less if the mean does as well."""

    name: str
    predict: Function
    r2: float


class Indices(NamedTuple):
    """Sobol indices (d,): share of the variance that a parameter moves alone, and with others;
    `reach` is half the width of the 95 % interval of the latter, of the sampling alone, by which a
    share may lie beyond 0 and 1, too."""

    first: Real
    total: Real
    reach: Real


def emulate(places: Real, values: Real, seed: int = 0) -> Emulator:
    """Return the better of a Gaussian process and a random forest, by cross-validation.

    `places` (n, d), `values` (n,), all finite. The process has a linear part and a smooth one.
    Raises ValueError for fewer draws than folds.
    """
    from sklearn.base import clone
    from sklearn.model_selection import KFold, cross_val_predict

    if len(values) < FOLDS:
        raise ValueError(f"{len(values)} draws are too few for an emulator")
    spread = float(values.std()) or 1.0
    scaled, best = (values - values.mean()) / spread, ("", -np.inf)
    candidates = _candidates(seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # bounds of a kernel that are reached
        for name, model in candidates.items():
            folds = KFold(FOLDS, shuffle=True, random_state=seed)
            told = cross_val_predict(clone(model), places, scaled, cv=folds)
            r2 = 1 - float(np.mean(np.square(told - scaled)) / (np.mean(scaled**2) or 1.0))
            best = max(best, (name, r2), key=lambda one: one[1])
        fitted = clone(candidates[best[0]]).fit(places, scaled)
    middle = float(values.mean())
    return Emulator(best[0], lambda x: middle + spread * fitted.predict(x), best[1])


def _candidates(seed: int) -> dict:
    from sklearn.ensemble import RandomForestRegressor
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, DotProduct, WhiteKernel

    kernel = ConstantKernel() * RBF(1.0) + ConstantKernel(0.1) * DotProduct() + WhiteKernel(0.1)
    return {
        "Gaussian process": GaussianProcessRegressor(kernel, normalize_y=True, random_state=seed),
        "random forest": RandomForestRegressor(TREES, min_samples_leaf=2, random_state=seed),
    }


def sobol(function: Function, dimensions: int, seed: int = 0, points: int = POINTS) -> Indices:
    """Return the Sobol indices of `function`, (n, d) in [0, 1] -> (n,), for even distributions.

    Saltelli et al. 2010, Computer Physics Communications 181, 259, as in scipy.
    """
    found = [
        sobol_indices(
            func=lambda x: function(x.T), n=points, dists=[uniform()] * dimensions,
            rng=np.random.default_rng([seed, time]),
        )
        for time in range(TIMES)
    ]  # fmt: skip
    first = np.array([np.ravel(one.first_order) for one in found])
    total = np.array([np.ravel(one.total_order) for one in found])
    quantile = student.ppf((1 + CONFIDENCE) / 2, TIMES - 1)
    reach = quantile * total.std(axis=0, ddof=1) / TIMES**0.5
    return Indices(first.mean(axis=0), total.mean(axis=0), reach)


def marginal(places: Real, values: Real) -> Real:
    """Return p (d,) of each parameter's rank correlation with `values` (n,) at `places` (n, d),
    times the number of parameters (Bonferroni): of the draws alone, no emulator between."""
    p = np.array([spearmanr(column, values).pvalue for column in places.T])
    return np.minimum(1.0, p * len(p))
