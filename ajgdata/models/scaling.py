"""Transformations of spectra and targets that scikit-learn lacks; each keeps the number of bins."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from sklearn.base import (
    BaseEstimator,
    MetaEstimatorMixin,
    OneToOneFeatureMixin,
    RegressorMixin,
    TransformerMixin,
    clone,
)
from sklearn.compose import TransformedTargetRegressor
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.validation import check_is_fitted, validate_data

from ajgdata.types import NotPossibleError


class Compress(OneToOneFeatureMixin, TransformerMixin, BaseEstimator):
    """x -> asinh(x / scale_), scale_ = `relative` * mean |x| of the training rows.

    Objects and poses multiply a spectrum, bin by bin: differences of logarithms are what matters.
    asinh is the logarithm (plus log 2) where x >> scale_, is defined at 0, and does not blow up
    the noise of bins without signal. The CNN does the same inside, with a scale of its own.
    """

    scale_: float

    def __init__(self, relative: float = 0.1) -> None:
        self.relative = relative

    def fit(self, X: Any, y: Any = None) -> Self:
        """Learn `scale_` from features (n, n_features)."""
        X = validate_data(self, X, dtype=np.float64)
        self.scale_ = float(np.abs(X).mean() * self.relative) or 1.0
        return self

    def transform(self, X: Any) -> np.ndarray:
        """Return compressed features (n, n_features), float64."""
        check_is_fitted(self)
        return np.arcsinh(validate_data(self, X, reset=False, dtype=np.float64) / self.scale_)


def raw_scaling() -> Pipeline:
    """Return the first steps of the baselines: compress, standardise."""
    return make_pipeline(Compress(), StandardScaler())


def scaled_target(model: BaseEstimator) -> BaseEstimator:
    """Return `model` with its target scaled: its settings suppose one of order one."""
    return TransformedTargetRegressor(model, transformer=StandardScaler())


class AtLeast(OneToOneFeatureMixin, TransformerMixin, BaseEstimator):
    """Passes features on as they are, in float64, and learns from no fewer than `rows` recordings.

    k-NN would train on fewer than k, and then not predict.
    """

    def __init__(self, rows: int = 1) -> None:
        self.rows = rows

    def fit(self, X: Any, y: Any = None) -> Self:
        """Count features (n, n_features). Raises NotPossibleError for n < `rows`."""
        X = validate_data(self, X, dtype=np.float64)
        if len(X) < self.rows:
            raise NotPossibleError(f"{len(X)} recordings to learn from: {self.rows} are needed")
        return self

    def transform(self, X: Any) -> np.ndarray:
        """Return features (n, n_features), float64."""
        check_is_fitted(self)
        return validate_data(self, X, reset=False, dtype=np.float64)

    def __sklearn_is_fitted__(self) -> bool:
        return hasattr(self, "n_features_in_")


class OneScale(StandardScaler):
    """(x - mean of the bin) / s, with one s for all bins: the root of their mean variance.

    Loud bins go on counting more than quiet ones; `StandardScaler` makes all alike.
    """

    def fit(self, X: Any, y: Any = None, sample_weight: Any = None) -> Self:
        """Learn means and the one scale from features (n, n_features)."""
        super().fit(X, y, sample_weight)
        self.scale_ = np.full_like(self.mean_, np.sqrt(self.var_.mean()) or 1.0)
        return self


class Circular(MetaEstimatorMixin, RegressorMixin, BaseEstimator):
    """Regression of a target that repeats, as the angle of a bar does after half a turn.

    0 and 179 degrees are then one degree apart, but a model of the plain number must tell them
    apart. `estimator` is fitted to the point (sin 2 pi y / P, cos 2 pi y / P) instead, which moves
    steadily with y; predictions are in [0, `period`).
    """

    estimator_: Any

    def __init__(self, estimator: BaseEstimator, period: float) -> None:
        self.estimator = estimator
        self.period = period

    def fit(self, X: Any, y: Any) -> Self:
        """Train on features (n, n_features) and targets (n,) in any turn."""
        self.estimator_ = clone(self.estimator)
        self.estimator_.fit(X, self.coordinates(y))
        return self

    def coordinates(self, y: Any) -> np.ndarray:
        """Return the point (n, 2) that stands for each target (n,)."""
        turn = 2 * np.pi * np.asarray(y, np.float64) / self.period
        return np.column_stack([np.sin(turn), np.cos(turn)])

    def targets(self, points: np.ndarray) -> np.ndarray:
        """Return the target (n,) that each point (n, 2) stands for, however near to the centre."""
        sine, cosine = points.T
        turns = np.arctan2(sine, cosine) / (2 * np.pi)
        return turns % 1.0 % 1.0 * self.period  # twice: -1e-17 % 1.0 is 1.0

    def predict(self, X: Any) -> np.ndarray:
        """Return the target (n,): the direction of the predicted point."""
        check_is_fitted(self)
        return self.targets(self.estimator_.predict(X))
