"""Models whose input is not only a row of values: dimensions of the feature, and covariates.

Both wrappers have the input (n, f + c) of all models, see `types.input_layout.InputLayout`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Self

import numpy as np
from sklearn.base import BaseEstimator, MetaEstimatorMixin, clone, is_classifier
from sklearn.linear_model import LogisticRegression, Ridge
from sklearn.neighbors import KNeighborsClassifier, KNeighborsRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils import get_tags
from sklearn.utils.metaestimators import available_if
from sklearn.utils.validation import check_is_fitted

from ajgdata.models.scaling import AtLeast
from ajgdata.models.tuning import Tuned
from ajgdata.types import Kind, NotPossibleError

#: Smallest factor of a probability, so that the sum over the classes is not 0.
_TINY = 1e-100
#: Largest deviation of a constant column, as a share of its largest value. Rounding is far smaller,
#: and measured covariates have far larger deviations.
_CONSTANT = 1e-9


def _estimator_has(method: str) -> Callable[[Any], bool]:
    """Return a check of a wrapper: whether its estimator has a method."""
    return lambda wrapper: hasattr(wrapper.estimator, method)


class _Wrapper(MetaEstimatorMixin, BaseEstimator):
    """A model in another one, of the same kind."""

    estimator: Any
    estimator_: Any
    n_features_in_: int

    def __sklearn_tags__(self) -> Any:
        return get_tags(self.estimator)

    @property
    def classes_(self) -> np.ndarray:
        """Return the classes (k,) of the model."""
        return self.estimator_.classes_


class WithDimensions(_Wrapper):
    """A model that gets features as arrays (n, dimension, ...), with a `shape` (dimension, ...).

    A row of the input has the values of the array, and the last dimension varies fastest.
    """

    def __init__(self, estimator: BaseEstimator, shape: tuple[int, ...]) -> None:
        self.estimator = estimator
        self.shape = shape

    def fit(self, X: Any, y: Any) -> Self:
        """Train on features (n, f), or (n, dimension, ...), and on targets (n,) or (n, k)."""
        arrays = self._arrays(X)
        self.n_features_in_ = math.prod(self.shape)
        self.estimator_ = clone(self.estimator).fit(arrays, y)
        return self

    def _arrays(self, X: Any) -> np.ndarray:
        """Return features as (n, dimension, ...). Raises NotPossibleError for another size."""
        features = np.asarray(X)
        if features[0].size != math.prod(self.shape):
            raise NotPossibleError(
                f"a feature has {features[0].size} values, but its dimensions are {self.shape}"
            )
        return features.reshape(len(features), *self.shape)

    def predict(self, X: Any) -> np.ndarray:
        """Return the predictions of the model for features (n, f), or (n, dimension, ...)."""
        check_is_fitted(self, "estimator_")
        return self.estimator_.predict(self._arrays(X))

    @available_if(_estimator_has("predict_proba"))
    def predict_proba(self, X: Any) -> np.ndarray:
        """Return the probabilities (n, k) of `classes_` by the model."""
        check_is_fitted(self, "estimator_")
        return self.estimator_.predict_proba(self._arrays(X))


class WithCovariates(_Wrapper):
    """A model of a feature x, and covariates z: the last `count` columns of the input.

    Covariates are standardised; one that is constant in the training rows becomes 0 in all rows,
    because its effect cannot be measured. With least squares on the training rows, their linear
    effect B is removed from the feature: x - B z. The model is trained on the result.

    - Regression: the linear effect b of z on the target y is also removed, so the model is trained
      on y - b z, and b z is added to its predictions. With a linear model, this is least squares
      on feature and covariates together (theorem of Frisch, Waugh and Lovell).
    - Classification: B is the effect within classes. The probabilities of the model are multiplied
      by those of a logistic regression on z, and divided by the shares of the classes. This is the
      rule of Bayes if x - B z and z are independent in each class.
    """

    is_constant_: np.ndarray
    means_: np.ndarray
    deviations_: np.ndarray
    effect_on_feature_: np.ndarray
    effect_on_target_: np.ndarray
    classifier_: LogisticRegression
    shares_: np.ndarray

    def __init__(self, estimator: BaseEstimator, count: int) -> None:
        self.estimator = estimator
        self.count = count

    def fit(self, X: Any, y: Any) -> Self:
        """Train on inputs (n, f + count) and targets (n,) or (n, k).

        Raises NotPossibleError for a classifier without probabilities.
        """
        X = np.asarray(X, np.float64)
        y = np.asarray(y)
        self.n_features_in_ = X.shape[1]
        features = X[:, : -self.count]
        covariates = X[:, -self.count :]
        self.is_constant_ = _is_constant(covariates)
        self.means_ = covariates.mean(axis=0)
        self.deviations_ = np.where(self.is_constant_, 1.0, covariates.std(axis=0))
        z = self._standardised(X)
        if is_classifier(self.estimator):
            if not hasattr(self.estimator, "predict_proba"):
                raise NotPossibleError(
                    "the model has no probabilities, which covariates of a class need: "
                    "choose another model"
                )
            self._fit_classes(z, y)
            label = np.searchsorted(self.classifier_.classes_, y)
            z_within = _centred(z, label)
            z_within[:, np.abs(z_within).max(axis=0) <= _CONSTANT] = 0.0  # one value per class
            self.effect_on_feature_ = _effect(z_within, _centred(features, label))
            target = y
        else:
            self.effect_on_feature_ = _effect(z, features - features.mean(axis=0))
            self.effect_on_target_ = _effect(z, y - y.mean(axis=0))
            target = y - z @ self.effect_on_target_
        self.estimator_ = clone(self.estimator).fit(self._adjusted(X), target)
        return self

    def _fit_classes(self, z: np.ndarray, y: np.ndarray) -> None:
        """Learn the shares of the classes y (n,), and their probabilities for covariates z."""
        classes, counts = np.unique(y, return_counts=True)
        if len(classes) < 2:
            raise NotPossibleError(f"one class only, {classes.tolist()[0]!r}: two are needed")
        self.shares_ = counts / len(y)
        self.classifier_ = LogisticRegression(max_iter=1000).fit(z, y)

    def _standardised(self, X: np.ndarray) -> np.ndarray:
        """Return the standardised covariates (n, count) of inputs (n, f + count)."""
        z = (X[:, -self.count :] - self.means_) / self.deviations_
        return np.where(self.is_constant_, 0.0, z)

    def _adjusted(self, X: np.ndarray) -> np.ndarray:
        """Return features (n, f), float32, without the effect of the covariates."""
        effect = self._standardised(X) @ self.effect_on_feature_
        return (X[:, : -self.count] - effect).astype(np.float32)

    def predict(self, X: Any) -> np.ndarray:
        """Return the predictions (n,) or (n, k) for inputs (n, f + count)."""
        check_is_fitted(self, "estimator_")
        if is_classifier(self.estimator):
            return self.classes_[self.predict_proba(X).argmax(axis=1)]
        X = np.asarray(X, np.float64)
        added = self._standardised(X) @ self.effect_on_target_
        return self.estimator_.predict(self._adjusted(X)) + added

    @available_if(_estimator_has("predict_proba"))
    def predict_proba(self, X: Any) -> np.ndarray:
        """Return the probabilities (n, k) of `classes_` for inputs (n, f + count)."""
        check_is_fitted(self, "estimator_")
        X = np.asarray(X, np.float64)
        by_covariates = self.classifier_.predict_proba(self._standardised(X)) / self.shares_
        by_feature = self.estimator_.predict_proba(self._adjusted(X))
        product = by_feature * np.maximum(by_covariates, _TINY)
        return product / product.sum(axis=1, keepdims=True)


def _is_constant(covariates: np.ndarray) -> np.ndarray:
    """Return whether each column (c,) of covariates (n, c) has one value, except for rounding."""
    return covariates.std(axis=0) <= _CONSTANT * np.abs(covariates).max(axis=0)


def _centred(values: np.ndarray, label: np.ndarray) -> np.ndarray:
    """Return values (n, m) minus the mean of their class, of the number `label` (n,)."""
    counts = np.bincount(label)
    sums = np.zeros((len(counts), values.shape[1]))
    np.add.at(sums, label, values)
    return values - (sums / counts[:, np.newaxis])[label]


def _effect(z: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the least squares B (c, ...) of values (n, ...) = z B, with covariates z (n, c)."""
    return np.linalg.lstsq(z, values, rcond=None)[0]


class CovariatesAlone(_Wrapper):
    """A model of the covariates, the last `count` columns of the input, without the feature.

    A covariate that is constant in the training rows becomes 0 in all rows.
    """

    is_constant_: np.ndarray

    def __init__(self, estimator: BaseEstimator, count: int) -> None:
        self.estimator = estimator
        self.count = count

    def fit(self, X: Any, y: Any) -> Self:
        """Train on inputs (n, f + count) and targets (n,) or (n, k)."""
        X = np.asarray(X, np.float64)
        self.n_features_in_ = X.shape[1]
        self.is_constant_ = _is_constant(X[:, -self.count :])
        self.estimator_ = clone(self.estimator).fit(self._covariates(X), y)
        return self

    def _covariates(self, X: Any) -> np.ndarray:
        """Return the covariates (n, count) of inputs (n, f + count)."""
        covariates = np.asarray(X, np.float64)[:, -self.count :]
        return np.where(self.is_constant_, 0.0, covariates)

    def predict(self, X: Any) -> np.ndarray:
        """Return the predictions (n,) or (n, k) for inputs (n, f + count)."""
        check_is_fitted(self, "estimator_")
        return self.estimator_.predict(self._covariates(X))

    @available_if(_estimator_has("predict_proba"))
    def predict_proba(self, X: Any) -> np.ndarray:
        """Return the probabilities (n, k) of `classes_` for inputs (n, f + count)."""
        check_is_fitted(self, "estimator_")
        return self.estimator_.predict_proba(self._covariates(X))


def covariates_alone(kind: Kind, seed: int) -> Tuned:
    """Return the choice of a linear model and k-NN, for covariates (n, c).

    k-NN also detects values of the covariates that identify a class.
    """
    if kind == "regression":
        linear = Ridge(alpha=1e-3)
        neighbours = KNeighborsRegressor
    else:
        linear = LogisticRegression(max_iter=1000)
        neighbours = KNeighborsClassifier
    candidates = [("linear", make_pipeline(StandardScaler(), linear))]
    for k in (5, 1):
        steps = (AtLeast(k), StandardScaler(), neighbours(n_neighbors=k))
        candidates.append((f"k-NN, k = {k}", make_pipeline(*steps)))
    return Tuned(candidates, random_state=seed)
