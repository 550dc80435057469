"""Scalings of spectra and targets that scikit-learn does not have."""

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
    """Compress features x to asinh(x / scale_), with scale_ = `relative` * mean |x| in training.

    An object or a pose multiplies each bin of a spectrum by a factor, so differences of logarithms
    are relevant. For x >> scale_, asinh(x / scale_) is log(2 x / scale_). It is also defined at 0,
    and it does not amplify the noise of bins without signal. The networks of `cnn` have their own
    compression.
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
    """Return a scaling that compresses features and then standardises each bin."""
    return make_pipeline(Compress(), StandardScaler())


def scaled_target(model: BaseEstimator) -> BaseEstimator:
    """Return `model` with a standardised target, because its settings suit unit variance."""
    return TransformedTargetRegressor(model, transformer=StandardScaler())


class AtLeast(OneToOneFeatureMixin, TransformerMixin, BaseEstimator):
    """Leave features unchanged (as float64), but refuse to train on fewer than `rows` recordings.

    k-NN can be trained on fewer than k recordings, but its predictions then fail.
    """

    def __init__(self, rows: int = 1) -> None:
        self.rows = rows

    def fit(self, X: Any, y: Any = None) -> Self:
        """Check the number of features (n, n_features). Raises NotPossibleError for n < `rows`."""
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
    """Scale features x to (x - mean of the bin) / s, with one s for all bins.

    s² is the mean of the variances of the bins. Bins with a larger variance therefore keep a larger
    weight; with `StandardScaler`, all bins have equal weight.
    """

    def fit(self, X: Any, y: Any = None, sample_weight: Any = None) -> Self:
        """Learn the means and the scale from features (n, n_features)."""
        super().fit(X, y, sample_weight)
        self.scale_ = np.full_like(self.mean_, np.sqrt(self.var_.mean()) or 1.0)
        return self


class Circular(MetaEstimatorMixin, RegressorMixin, BaseEstimator):
    """Regression of a target with a period P, for example the angle of a bar (P = 180 degrees).

    The angles 0 and 179 degrees of a bar differ by one degree, but as numbers by 179. `estimator`
    is therefore fitted to the point (sin 2 pi y / P, cos 2 pi y / P), which is a continuous
    function of the angle. Predictions are in [0, `period`).
    """

    estimator_: Any

    def __init__(self, estimator: BaseEstimator, period: float) -> None:
        self.estimator = estimator
        self.period = period

    def fit(self, X: Any, y: Any) -> Self:
        """Train on features (n, n_features) and targets (n,), which can be outside [0, period)."""
        self.estimator_ = clone(self.estimator)
        self.estimator_.fit(X, self.coordinates(y))
        return self

    def coordinates(self, y: Any) -> np.ndarray:
        """Return the point (n, 2) on the unit circle of each target (n,)."""
        angle = 2 * np.pi * np.asarray(y, np.float64) / self.period
        return np.column_stack([np.sin(angle), np.cos(angle)])

    def targets(self, points: np.ndarray) -> np.ndarray:
        """Return the target (n,) in the direction of each point (n, 2)."""
        sine, cosine = points.T
        turns = np.arctan2(sine, cosine) / (2 * np.pi)
        return turns % 1.0 % 1.0 * self.period  # the second % is needed: -1e-17 % 1.0 is 1.0

    def predict(self, X: Any) -> np.ndarray:
        """Return the target (n,) of features (n, n_features)."""
        check_is_fitted(self)
        return self.targets(self.estimator_.predict(X))
