"""Registry of the models that a config may name.

Choices in dataset.yaml, labels in the report, documentation and contract tests follow from it.
Installed packages add models by entry points (docs/examples/own_model_package).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from typing import Literal, TypeVar

Kind = Literal["regression", "classification"]
Entry = TypeVar("Entry")

#: Largest number of training recordings: the kernel of support vectors and the neighbours of k-NN
#: cost as its square, networks take more than one step per recording, and others store the
#: features three times in float64 (25 kB each).
_SVM, _NETWORK, _KNN, _OTHER = 5_000, 10_000, 20_000, 30_000
#: Types in the files of models that skops does not list as safe: others are not loaded.
TRUSTED_TYPES = (
    "ajgdata.models.cnn.CnnClassifier",
    "ajgdata.models.cnn.CnnRegressor",
    "ajgdata.models.scaling.AtLeast",
    "ajgdata.models.scaling.Circular",
    "ajgdata.models.scaling.Compress",
    "ajgdata.models.scaling.OneScale",
    "sklearn.tree._tree.Tree",
    "sklearn.ensemble._hist_gradient_boosting.predictor.TreePredictor",
    "sklearn.neural_network._stochastic_optimizers.AdamOptimizer",
    "sklearn.metrics._dist_metrics.ManhattanDistance64",
    # of up to 15 features, as after a projection of few recordings
    "sklearn.metrics._dist_metrics.EuclideanDistance64",
    "sklearn.neighbors._kd_tree.KDTree",
)


@dataclass(frozen=True)
class Model:
    """A model that a task may name.

    `make` is `module:function`, called with (kind, seed) for an unfitted scikit-learn estimator;
    `classification` and `regression` (default: the same) are its names in the report. With more
    than `most_recordings`, it is trained on an even subset. `several` is whether its regressor fits
    also targets (n, k). `plain` is the name of the same model without a choice of settings; "" for
    one that is not tuned.
    """

    make: str
    classification: str
    most_recordings: int = _OTHER
    regression: str = ""
    several: bool = True
    plain: str = ""

    def label(self, kind: Kind) -> str:
        """Return its name in the report."""
        return (kind == "regression" and self.regression) or self.classification


class Registry(dict[str, Entry]):
    """Entries by name. An unknown name is a ValueError that lists the names."""

    def __init__(self, noun: str, entries: Mapping[str, Entry]) -> None:
        super().__init__(entries)
        self.noun = noun

    def __missing__(self, name: str) -> Entry:
        known = ", ".join(self)
        raise ValueError(f"unknown {self.noun} {name!r}: choose one of {known}")

    def add(self, name: str, entry: Entry, point: EntryPoint) -> None:
        """Add an entry of another package. Raises ImportError if the name exists."""
        if name in self:
            raise ImportError(f"package {point.module}: {self.noun} {name!r} exists, rename it")
        self[name] = entry

    def checked(self, name: str) -> str:
        """Return `name`. Raises ValueError for an unknown name."""
        self[name]
        return name


#: Models of other packages: name, and `module:function`, which is imported when it is used.
OWN_MODELS = entry_points(group="ajgdata.models")
_BASELINES = "ajgdata.models.baselines"
MODELS = Registry(
    "model",
    {
        "cnn": Model("ajgdata.models.cnn:cnn", "CNN", _NETWORK),
        "linear": Model(
            f"{_BASELINES}:linear", "logistic regression", regression="ridge", plain="linear_plain"
        ),
        "ridge": Model(
            f"{_BASELINES}:ridge", "ridge classifier", regression="ridge", plain="ridge_plain"
        ),
        "knn": Model(f"{_BASELINES}:nearest_neighbours", "k-NN", _KNN, plain="knn_plain"),
        "svm": Model(
            f"{_BASELINES}:support_vectors", "SVM", _SVM, several=False, plain="svm_plain"
        ),
        "boosting": Model(f"{_BASELINES}:boosting", "gradient boosting", several=False),
        "forest": Model(f"{_BASELINES}:forest", "random forest"),
        "mlp": Model(f"{_BASELINES}:perceptron", "MLP", _NETWORK),
        "linear_plain": Model(
            f"{_BASELINES}:linear_plain", "logistic regression, plain", regression="ridge, plain"
        ),
        "ridge_plain": Model(
            f"{_BASELINES}:ridge_plain", "ridge classifier, plain", regression="ridge, plain"
        ),
        "knn_plain": Model(f"{_BASELINES}:nearest_neighbours_plain", "k-NN, plain", _KNN),
        "svm_plain": Model(
            f"{_BASELINES}:support_vectors_plain", "SVM, plain", _SVM, several=False
        ),
        "cnn_per_bin": Model("ajgdata.models.cnn:cnn_per_bin", "CNN, scale per bin", _NETWORK),
    },
)
#: Models that share a job: measuring one takes about as long as starting a job.
PLAIN_MODELS = ("linear", "ridge", "knn", "linear_plain", "ridge_plain", "knn_plain")
for _point in OWN_MODELS:
    MODELS.add(_point.name, Model(_point.value, _point.name, several=False), _point)
