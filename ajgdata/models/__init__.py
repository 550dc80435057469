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
    "knn": Label("k-NN", "k-NN"),
    "svm": Label("SVM", "SVM"),
    "boosting": Label("gradient boosting", "gradient boosting"),
    "forest": Label("random forest", "random forest"),
    "mlp": Label("MLP", "MLP"),
}


def make_model(name: str, kind: Kind, seed: int = 0) -> BaseEstimator:
    """An unfitted scikit-learn estimator that takes features (n, n_features) as they are stored.

    Standardisation is part of the estimator, so it is learned from training rows only. The
    settings are the same for every data set. `seed` matters to networks and trees; the others have
    no chance in them. Raises ValueError for an unknown name or kind.
    """
    if name not in MODELS:
        raise ValueError(f"unknown model {name!r}: choose one of {', '.join(MODELS)}")
    if kind not in Label._fields:
        raise ValueError(f"unknown kind {kind!r}: choose one of {', '.join(Label._fields)}")
    if name == "cnn":
        from ajgdata.models.cnn import CnnClassifier, CnnRegressor  # torch: 2 s

        cnn = CnnClassifier if kind == "classification" else CnnRegressor
        return cnn(random_state=seed)
    from ajgdata.models.baselines import BASELINES

    return BASELINES[name](kind, seed)
