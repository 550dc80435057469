"""The models that the CNN must beat: scale, then one of scikit-learn's.

Those named here have one setting for all tasks, none tuned to a data set; `candidates` lists what
the tuned ones are chosen from.
"""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from sklearn.base import BaseEstimator, OneToOneFeatureMixin, TransformerMixin
from sklearn.compose import TransformedTargetRegressor
from sklearn.ensemble import (
    HistGradientBoostingClassifier,
    HistGradientBoostingRegressor,
    RandomForestClassifier,
    RandomForestRegressor,
)
from sklearn.linear_model import LogisticRegression, Ridge, RidgeClassifier
from sklearn.neighbors import KNeighborsClassifier, KNeighborsRegressor
from sklearn.neural_network import MLPClassifier, MLPRegressor
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVC, SVR
from sklearn.utils.validation import check_is_fitted, validate_data

from ajgdata.models.scaling import AtLeast
from ajgdata.types import Kind

NEIGHBOURS = 5  # scikit-learn's default; the paper does not give its k
RIDGE_ALPHA = (
    1000.0  # about one per bin: a standardised spectrum then weighs as much as the penalty
)
#: A few dozen are usual; the limit leaves room for data that separate perfectly.
LOGISTIC_STEPS = 2000
SVM_C = 1.0  # scikit-learn's default, as is its gamma: 1 / (bins * variance)
#: A class may have no more than some dozens of spectra, hence small leaves; few features a split
#: because neighbouring bins say the same: a tenth of the time, and trees that differ.
BOOSTING = {
    "max_iter": 50,
    "learning_rate": 0.2,
    "max_leaf_nodes": 8,
    "min_samples_leaf": 5,
    "max_features": 0.1,
    "max_bins": 32,  # of some hundred spectra; 255 take four times as long and err as often
    "early_stopping": False,
}
FOREST = {"n_estimators": 200, "max_features": "sqrt"}
#: Stops when the training loss no longer falls (1e-4 in 10 epochs), long before `max_iter`.
MLP = {"hidden_layer_sizes": (128,), "alpha": 1e-4, "max_iter": 2000}


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


def _after_scaling(model: BaseEstimator) -> Pipeline:
    return make_pipeline(Compress(), StandardScaler(), model)


def scaled_target(model: BaseEstimator) -> BaseEstimator:
    """Return `model` with its target scaled: its settings suppose one of order one."""
    return TransformedTargetRegressor(model, transformer=StandardScaler())


def logistic(kind: Kind, seed: int) -> Pipeline:
    """Return logistic regression (lbfgs, C = 1), or ridge."""
    if kind == "regression":
        return ridge(kind, seed)
    return _after_scaling(LogisticRegression(max_iter=LOGISTIC_STEPS))


def ridge(kind: Kind, seed: int) -> Pipeline:
    """Return least squares with a penalty; for classes on -1 and 1 of each. Solved at once, hence
    fast."""
    cls = Ridge if kind == "regression" else RidgeClassifier
    return _after_scaling(cls(alpha=RIDGE_ALPHA))


def nearest_neighbours(kind: Kind, seed: int) -> Pipeline:
    """Return k-NN by the Euclidean distance of features as they are stored, as the paper says
    nothing of a scaling; it needs at least k training rows."""
    knn = KNeighborsRegressor if kind == "regression" else KNeighborsClassifier
    return make_pipeline(AtLeast(NEIGHBOURS), knn(n_neighbors=NEIGHBOURS))


def support_vectors(kind: Kind, seed: int) -> Pipeline:
    """Return a support vector machine with a Gaussian (RBF) kernel. As a classifier it has no
    probabilities: its margins are not any, and fitting some to them would take a split of its
    own."""
    if kind == "regression":
        return _after_scaling(scaled_target(SVR(C=SVM_C)))
    return _after_scaling(SVC(C=SVM_C))


def boosting(kind: Kind, seed: int) -> Pipeline:
    """Return gradient boosting of histogram trees."""
    if kind == "regression":
        return _after_scaling(HistGradientBoostingRegressor(**BOOSTING, random_state=seed))
    return _after_scaling(HistGradientBoostingClassifier(**BOOSTING, random_state=seed))


def forest(kind: Kind, seed: int) -> Pipeline:
    """Return a random forest, each split among the root of the number of bins."""
    trees = RandomForestRegressor if kind == "regression" else RandomForestClassifier
    return _after_scaling(trees(**FOREST, random_state=seed))


def perceptron(kind: Kind, seed: int) -> Pipeline:
    """Return a multilayer perceptron with one hidden layer, trained by Adam."""
    if kind == "regression":
        return _after_scaling(scaled_target(MLPRegressor(**MLP, random_state=seed)))
    return _after_scaling(MLPClassifier(**MLP, random_state=seed))
