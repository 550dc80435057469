"""Models by name, and their training on arrays. `types.registry.MODELS` lists the models."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pkgutil import resolve_name
from typing import Any, get_args

import numpy as np
from sklearn.base import BaseEstimator
from sklearn.multioutput import MultiOutputRegressor
from sklearn.utils.validation import has_fit_parameter

from ajgdata.models.inputs import CovariatesAlone, WithCovariates, WithDimensions
from ajgdata.models.scaling import Circular
from ajgdata.models.thinning import thinned
from ajgdata.models.tuning import Tuned
from ajgdata.types import MODELS, Kind, NotPossibleError
from ajgdata.types.extras import optional_packages
from ajgdata.types.input_layout import InputLayout
from ajgdata.types.registry import COVARIATES_ALONE

#: Parameter by which the function of a model declares that the model takes the dimensions.
DIMENSIONS = "dimensions"


def make_model(
    name: str,
    kind: Kind,
    seed: int = 0,
    period: float | None = None,
    axes: int = 1,
    layout: InputLayout | None = None,
) -> BaseEstimator:
    """Return an unfitted scikit-learn estimator for features (n, n_features) as they are stored.

    The estimator contains the scaling. A tuned model chooses the scaling and its settings from its
    training rows. Networks, trees and inner folds use the `seed`. With a `period`, the targets y
    and y + period are equal: the model predicts (sin, cos) of 2 pi y / period (see
    `scaling.Circular`). A target with several `axes` is a vector (n, axes).

    A model whose function has a parameter `dimensions` gets arrays (n, dimension, ...); it needs
    the `layout` of the input. With covariates in the layout, the input is (n, f + c), see
    `inputs.WithCovariates`.

    Raises ValueError for an unknown name or kind, and for a classification with a period. Raises
    DataError for a network if its packages are not installed. Raises NotPossibleError for a model
    that needs a layout but has none, and for `covariates_alone` without covariates.

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
    with optional_packages(f"model {name}"):
        make = resolve_name(model.make)
    estimator = _made(name, make, kind, seed, layout)
    count = 0 if layout is None else len(layout.covariates)
    if name == COVARIATES_ALONE:
        if not count:
            raise NotPossibleError(f"model {name} needs `covariates` of the task")
        estimator = _wrapped(estimator, lambda model: CovariatesAlone(model, count))
    elif count:
        estimator = _wrapped(estimator, lambda model: WithCovariates(model, count))
    if period is not None:
        return _circular(estimator, period, model.several)
    if axes > 1 and not model.several:
        return _wrapped(estimator, MultiOutputRegressor)
    return estimator


def _made(
    name: str, make: Callable[..., BaseEstimator], kind: Kind, seed: int, layout: InputLayout | None
) -> BaseEstimator:
    """Return the estimator of the function `make` of a model, with the dimensions if it takes them.

    Raises NotPossibleError if they are not known, or if the model refuses them by a ValueError.
    """
    if DIMENSIONS not in inspect.signature(make).parameters:
        return make(kind, seed)
    if layout is None:
        raise NotPossibleError(
            f"model {name} takes the dimensions of the feature, which this experiment does not "
            "pass: choose another model"
        )
    try:
        estimator = make(kind, seed, dimensions=layout.dimensions)
    except ValueError as error:
        raise NotPossibleError(f"model {name}: {error}") from None
    shape = layout.shape
    return _wrapped(estimator, lambda model: WithDimensions(model, shape))


def _circular(estimator: BaseEstimator, period: float, several: bool) -> BaseEstimator:
    """Return a regressor of a target with a period.

    `several` is true if the estimator can be fitted to targets (n, 2). Otherwise there is one
    estimator for each of the two columns.
    """

    def wrap(regressor: BaseEstimator) -> BaseEstimator:
        return Circular(regressor if several else MultiOutputRegressor(regressor), period)

    return _wrapped(estimator, wrap, period)


def _wrapped(
    estimator: BaseEstimator,
    wrap: Callable[[BaseEstimator], BaseEstimator],
    period: float | None = None,
) -> BaseEstimator:
    """Return an estimator in another one. Of a tuned model, this wraps each candidate."""
    if isinstance(estimator, Tuned):
        return estimator.wrapped(wrap, period)
    return wrap(estimator)


def fit_model(
    model: BaseEstimator,
    features: np.ndarray,
    target: np.ndarray,
    groups: np.ndarray | None,
    limit: int | None = None,
) -> Any:
    """Return `model` trained on features (n, n_features) and `target` (n,), or (n, k) of a vector.

    The inner folds of a tuned model never divide `groups` (n,). Without groups, it uses its first
    candidate. If there are more than `limit` recordings, the model is trained on a subset of this
    size (see `thinned`).
    """
    if limit is not None and len(target) > limit:
        rows = thinned(np.arange(len(target)) if groups is None else groups, limit, target)
        features = features[rows]
        target = target[rows]
        if groups is not None:
            groups = groups[rows]
    estimator: Any = model
    if groups is not None and has_fit_parameter(estimator, "groups"):
        return estimator.fit(features, target, groups=groups)
    return estimator.fit(features, target)


def number_of_axes(target: np.ndarray) -> int:
    """Return the number of columns of a target (n,) or (n, k)."""
    return 1 if target.ndim == 1 else target.shape[1]


def fit_named_model(
    name: str,
    kind: Kind,
    features: np.ndarray,
    target: np.ndarray,
    groups: np.ndarray | None,
    *,
    seed: int = 0,
    period: float | None = None,
    layout: InputLayout | None = None,
) -> Any:
    """Return the model `name` (see `make_model`), trained by `fit_model` with the model's limit."""
    model = make_model(name, kind, seed, period, number_of_axes(target), layout)
    return fit_model(model, features, target, groups, MODELS[name].most_recordings)


def search_result(fitted: BaseEstimator) -> tuple[BaseEstimator, dict[str, Any] | None]:
    """Return the estimator that predicts, and for a tuned model a description of its search.

    The description has values for JSON: `choice` (name of the candidate), `reason` (why there was
    no search, or ""), `inner_folds` (their number), and `scores` by candidate. It also has the
    excluded candidates `left_out`, if any, and the number of recordings of the search, `chosen_on`,
    if this is not the number of all recordings.
    """
    if not isinstance(fitted, Tuned):
        return fitted, None
    description: dict[str, Any] = {
        "choice": fitted.choice_,
        "reason": fitted.reason_,
        "inner_folds": fitted.inner_folds_,
        "scores": fitted.inner_scores_,
    }
    if fitted.left_out_:
        description["left_out"] = fitted.left_out_
    if fitted.chosen_on_:
        description["chosen_on"] = fitted.chosen_on_
    return fitted.best_estimator_, description
