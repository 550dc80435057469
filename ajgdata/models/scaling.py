"""Scalings of a spectrum that scikit-learn lacks; each keeps the number of bins."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from sklearn.base import BaseEstimator, OneToOneFeatureMixin, TransformerMixin
from sklearn.preprocessing import StandardScaler
from sklearn.utils.validation import check_is_fitted, validate_data

from ajgdata.types import NotPossibleError


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
