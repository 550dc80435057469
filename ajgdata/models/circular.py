"""Regression of a target that repeats, as the angle of a bar does after half a turn.

0 and 179 degrees are then one degree apart, but a model of the plain number must tell them apart.
It learns the point (sin 2 pi y / P, cos 2 pi y / P) instead, which moves steadily with y.
"""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from sklearn.base import BaseEstimator, MetaEstimatorMixin, RegressorMixin, clone
from sklearn.utils.validation import check_is_fitted


class Circular(MetaEstimatorMixin, RegressorMixin, BaseEstimator):
    """Fits `estimator` to the two coordinates of y; predicts y in [0, `period`)."""

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
