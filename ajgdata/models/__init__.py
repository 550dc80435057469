"""Models: arrays in, arrays out. Importing this package is fast; `make_model` imports scikit-learn.

Which models there are stands in `types.registry.MODELS`.
"""

from __future__ import annotations

from pkgutil import resolve_name
from typing import Any, get_args

import numpy as np
from sklearn.base import BaseEstimator
from sklearn.multioutput import MultiOutputRegressor
from sklearn.utils.validation import has_fit_parameter

from ajgdata.models.scaling import Circular
from ajgdata.models.thinning import thinned
from ajgdata.models.tuning import Tuned
from ajgdata.types import MODELS, Kind


def make_model(name: str, kind: Kind, seed: int = 0, period: float | None = None) -> BaseEstimator:
    """Return an unfitted scikit-learn estimator of features (n, n_features) as they are stored.

    Scaling is part of the estimator. A tuned model chooses it and its settings from training rows.
    `seed` matters to networks, trees and inner folds. With a `period`, y and y + period are the
    same target: the model learns (sin, cos) of 2 pi y / period (see `scaling.Circular`). Raises
    ValueError for an unknown name or kind, and for classes with a period.

    >>> import numpy as np
    >>> from ajgdata.models import make_model
    >>> edge_mm = np.repeat([10.0, 20.0, 30.0], 8)
    >>> features = np.outer(edge_mm, np.linspace(1, 2, 50))  # (24, 50)
    >>> model = make_model("knn", "regression").fit(features, edge_mm)
    >>> model.predict(features[[0, 8, 16]])
    array([10., 20., 30.])
    """
    model = MODELS[name]
    if kind not in get_args(Kind):
        raise ValueError(f"unknown kind {kind!r}: choose one of {', '.join(get_args(Kind))}")
    if period is not None and kind != "regression":
        raise ValueError("classes have no period: leave it out")
    estimator = resolve_name(model.make)(kind, seed)
    return estimator if period is None else _circular(estimator, period, model.several)


def _circular(estimator: BaseEstimator, period: float, several: bool) -> BaseEstimator:
    """Return a regressor of a repeating target; `several`: it fits targets (n, 2) itself."""

    def wrap(regressor: BaseEstimator) -> BaseEstimator:
        return Circular(regressor if several else MultiOutputRegressor(regressor), period)

    return estimator.circular(wrap, period) if isinstance(estimator, Tuned) else wrap(estimator)


def fit_model(
    model: BaseEstimator,
    features: np.ndarray,
    target: np.ndarray,
    groups: np.ndarray | None,
    limit: int | None = None,
) -> Any:
    """Return `model` trained on features (n, n_features) and `target` (n,).

    Inner folds of a tuned model never split `groups` (n,); without groups it chooses nothing.
    With more than `limit` recordings, an even subset is used (see `thinned`).
    """
    if limit is not None and len(target) > limit:
        rows = thinned(np.arange(len(target)) if groups is None else groups, limit, target)
        features, target = features[rows], target[rows]
        groups = None if groups is None else groups[rows]
    estimator: Any = model
    if groups is not None and has_fit_parameter(estimator, "groups"):
        return estimator.fit(features, target, groups=groups)
    return estimator.fit(features, target)


def fit_named_model(
    name: str,
    kind: Kind,
    features: np.ndarray,
    target: np.ndarray,
    groups: np.ndarray | None,
    *,
    seed: int = 0,
    period: float | None = None,
) -> Any:
    """Return the model `name` (see `make_model`), trained by `fit_model` with its limit."""
    model = make_model(name, kind, seed, period)
    return fit_model(model, features, target, groups, MODELS[name].most_recordings)


def chosen(fitted: BaseEstimator) -> tuple[BaseEstimator, dict[str, Any] | None]:
    """Return the ordinary estimator that a fitted model has become, and of a tuned one how it was
    chosen, as JSON can hold it: `choice`, `reason` if there was none, `inner_folds`, `scores`,
    the candidates `left_out`, and on how many recordings, `chosen_on`, if not on all."""
    if not isinstance(fitted, Tuned):
        return fitted, None
    about: dict[str, Any] = {"choice": fitted.choice_, "reason": fitted.reason_}
    about |= {"inner_folds": fitted.inner_folds_, "scores": fitted.inner_scores_}
    about |= {"left_out": fitted.left_out_} if fitted.left_out_ else {}
    about |= {"chosen_on": fitted.chosen_on_} if fitted.chosen_on_ else {}
    return fitted.best_estimator_, about
