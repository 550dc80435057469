"""The models that the CNN must beat: compress, standardise, then linear or nearest neighbours.

One setting for all tasks, none tuned to a data set.
"""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from sklearn.base import BaseEstimator, OneToOneFeatureMixin, TransformerMixin
from sklearn.linear_model import LogisticRegression, Ridge
from sklearn.neighbors import KNeighborsClassifier, KNeighborsRegressor
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.validation import check_is_fitted, validate_data

from ajgdata.types import Kind

NEIGHBOURS = 5  # scikit-learn's default; the paper does not give its k
RIDGE_ALPHA = (
    1000.0  # about one per bin: a standardised spectrum then weighs as much as the penalty
)


class Compress(OneToOneFeatureMixin, TransformerMixin, BaseEstimator):
    """x -> asinh(x / scale_), scale_ = `relative` * mean |x| of the training rows.

    Objects and poses multiply a spectrum, bin by bin: differences of logarithms are what matters.
    asinh is the logarithm (plus log 2) where x >> scale_, is defined at 0, and does not blow up
    the noise of bins without signal. The CNN does the same inside.
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
        """Compressed features (n, n_features), float64."""
        check_is_fitted(self)
        return np.arcsinh(validate_data(self, X, reset=False, dtype=np.float64) / self.scale_)


def linear(kind: Kind) -> Pipeline:
    """Logistic regression (lbfgs, C = 1), or ridge."""
    if kind == "regression":
        return make_pipeline(Compress(), StandardScaler(), Ridge(alpha=RIDGE_ALPHA))
    # a few dozen steps are usual; the limit leaves room for data that separate perfectly
    return make_pipeline(Compress(), StandardScaler(), LogisticRegression(C=1.0, max_iter=2000))


def nearest_neighbours(kind: Kind) -> Pipeline:
    """k-NN on the Euclidean distance; needs at least k training rows."""
    knn = KNeighborsRegressor if kind == "regression" else KNeighborsClassifier
    return make_pipeline(Compress(), StandardScaler(), knn(n_neighbors=NEIGHBOURS))
