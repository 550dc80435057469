"""Models: arrays in, arrays out. Importing this package costs nothing; `make_model` imports.

Which models there are stands in `types.registry.MODELS`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, get_args

from ajgdata.types import MODELS, Kind
from ajgdata.types.registry import resolve

if TYPE_CHECKING:
    import numpy as np
    from sklearn.base import BaseEstimator


def make_model(name: str, kind: Kind, seed: int = 0, period: float | None = None) -> BaseEstimator:
    """Return an unfitted scikit-learn estimator of features (n, n_features) as they are stored.

    Standardisation is part of the estimator, so it is learned from training rows only. The
    settings are the same for every data set. `seed` matters to networks and trees; the others have
    no chance in them. With a `period`, y and y + period are the same target: the model then learns
    (sin, cos) of 2 pi y / period (see `circular`). Raises ValueError for an unknown name or kind,
    for a model of another package that cannot be imported, and for classes with a period.

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
    estimator = resolve(model.make)(kind, seed)
    if period is None:
        return estimator
    from sklearn.multioutput import MultiOutputRegressor

    from ajgdata.models.circular import Circular

    return Circular(estimator if model.several else MultiOutputRegressor(estimator), period)


def model_label(name: str, kind: Kind) -> str:
    """Return the name that the report gives a model; its plain name if it cannot be imported."""
    try:
        return MODELS[name].label(kind)
    except ValueError:
        return name


def trusted_types(name: str) -> tuple[str, ...]:
    """Return the types that the file of a trained model may hold, beside scikit-learn's."""
    return (*MODELS[name].trusted, "ajgdata.models.circular.Circular")


def network_state(
    fitted: BaseEstimator,
) -> tuple[dict[str, np.ndarray], dict[str, Any]] | None:
    """Return all there is to a fitted network: arrays by name, and a dict that JSON can hold.

    None for an estimator without `state()`, of which scikit-learn's own file is written.
    """
    from ajgdata.models.circular import Circular

    network = fitted.estimator_ if isinstance(fitted, Circular) else fitted
    return network.state() if hasattr(network, "state") else None


def restored_network(
    name: str,
    kind: Kind,
    period: float | None,
    arrays: dict[str, np.ndarray],
    about: Mapping[str, Any],
) -> BaseEstimator:
    """Return the fitted model whose `network_state` was `arrays` and `about`.

    `name`, `kind` and `period` are those of `make_model`. Raises ValueError for a state of another
    class.
    """
    model = make_model(name, kind, period=period)
    if period is None:
        return type(model).from_state(arrays, about)
    model.estimator_ = type(model.estimator).from_state(arrays, about)
    return model
