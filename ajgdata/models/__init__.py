"""Models: arrays in, arrays out. Importing this package costs nothing; `make_model` imports."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from ajgdata.types import Kind

if TYPE_CHECKING:
    from sklearn.base import BaseEstimator


class Label(NamedTuple):
    """What the report calls a model."""

    classification: str
    regression: str


#: Every model that a task may name.
MODELS = {
    "cnn": Label("CNN", "CNN"),
    "linear": Label("logistic regression", "ridge"),
    "ridge": Label("ridge classifier", "ridge"),
    "knn": Label("k-NN", "k-NN"),
    "svm": Label("SVM", "SVM"),
    "boosting": Label("gradient boosting", "gradient boosting"),
    "forest": Label("random forest", "random forest"),
    "mlp": Label("MLP", "MLP"),
}

#: Regressors that predict one number only: of two, each gets its own.
ONE_OUTPUT = ("svm", "boosting")


def make_model(name: str, kind: Kind, seed: int = 0, period: float | None = None) -> BaseEstimator:
    """An unfitted scikit-learn estimator that takes features (n, n_features) as they are stored.

    Standardisation is part of the estimator, so it is learned from training rows only. The
    settings are the same for every data set. `seed` matters to networks and trees; the others have
    no chance in them. With a `period`, y and y + period are the same target: the model then learns
    (sin, cos) of 2 pi y / period (see `circular`). Raises ValueError for an unknown name or kind,
    and for classes with a period.
    """
    if name not in MODELS:
        raise ValueError(f"unknown model {name!r}: choose one of {', '.join(MODELS)}")
    if kind not in Label._fields:
        raise ValueError(f"unknown kind {kind!r}: choose one of {', '.join(Label._fields)}")
    if period is not None:
        if kind != "regression":
            raise ValueError("classes have no period: leave it out")
        from sklearn.multioutput import MultiOutputRegressor

        from ajgdata.models.circular import Circular

        plain = make_model(name, kind, seed)
        return Circular(MultiOutputRegressor(plain) if name in ONE_OUTPUT else plain, period)
    if name == "cnn":
        from ajgdata.models.cnn import CnnClassifier, CnnRegressor  # torch: 2 s

        cnn = CnnClassifier if kind == "classification" else CnnRegressor
        return cnn(random_state=seed)
    from ajgdata.models.baselines import BASELINES

    return BASELINES[name](kind, seed)
