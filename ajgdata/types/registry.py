"""The registry of models: names in dataset.yaml, and labels in the report.

Installed packages add models by entry points (docs/examples/own_model_package).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from typing import Literal, TypeVar

#: Kind of a task: the labels are numbers or names of classes.
Kind = Literal["regression", "classification"]
Entry = TypeVar("Entry")

# Largest number of training recordings.
_SVM = 5_000  #: memory and time of the kernel matrix grow with the square of this number
_NETWORK = 10_000  #: training makes several passes over all recordings
_KNN = 20_000  #: the time for the distances grows with the square of this number
_OTHER = 30_000  #: training stores each feature three times in float64 (25 kB)
#: Types of other packages that files of models may contain: `module:class`.
OWN_TYPES = entry_points(group="ajgdata.model_types")
#: Types that files of models may contain, in addition to the safe types of skops. A file with any
#: other type is not loaded.
TRUSTED_TYPES = (
    "ajgdata.models.cnn.CnnClassifier",
    "ajgdata.models.cnn.CnnRegressor",
    "ajgdata.models.inputs.CovariatesAlone",
    "ajgdata.models.inputs.WithCovariates",
    "ajgdata.models.inputs.WithDimensions",
    "ajgdata.models.scaling.AtLeast",
    "ajgdata.models.scaling.Circular",
    "ajgdata.models.scaling.Compress",
    "ajgdata.models.scaling.OneScale",
    "sklearn.tree._tree.Tree",
    "sklearn.ensemble._hist_gradient_boosting.predictor.TreePredictor",
    "sklearn.neural_network._stochastic_optimizers.AdamOptimizer",
    "sklearn.metrics._dist_metrics.ManhattanDistance64",
    # k-NN uses a tree for up to 15 features, as after a projection of few recordings.
    "sklearn.metrics._dist_metrics.EuclideanDistance64",
    "sklearn.neighbors._kd_tree.KDTree",
    *(point.value.replace(":", ".") for point in OWN_TYPES),
)


@dataclass(frozen=True)
class Model:
    """A model that a task may name."""

    #: `module:function`. The function returns an unfitted scikit-learn estimator for (kind, seed).
    make: str
    classification: str  #: label in the report for classification
    #: Largest number of training recordings. If there are more, the model is trained on a subset.
    most_recordings: int = _OTHER
    regression: str = ""  #: label in the report for regression; "" if it is the same
    several: bool = True  #: whether the regressor also fits targets (n, k)
    plain: str = ""  #: name of the same model with fixed settings; "" if no setting is tuned
    extra: str = ""  #: extra of the installation that the model needs; "" for none

    def label(self, kind: Kind) -> str:
        """Return the label in the report."""
        if kind == "regression" and self.regression:
            return self.regression
        return self.classification


class Registry(dict[str, Entry]):
    """Entries by name. An unknown name raises a ValueError that lists the known names."""

    def __init__(self, noun: str, entries: Mapping[str, Entry]) -> None:
        super().__init__(entries)
        self.noun = noun

    def __missing__(self, name: str) -> Entry:
        known = ", ".join(self)
        raise ValueError(f"unknown {self.noun} {name!r}: choose one of {known}")

    def add(self, name: str, entry: Entry, point: EntryPoint) -> None:
        """Add an entry of another package, from its entry point.

        Raises ImportError if the name exists.
        """
        if name in self:
            raise ImportError(f"package {point.module}: {self.noun} {name!r} exists, rename it")
        self[name] = entry

    def checked(self, name: str) -> str:
        """Return `name`. Raises ValueError for an unknown name."""
        self[name]  # raises ValueError
        return name


#: Entry points of models in other packages: name and `module:function`. A module is imported when
#: its model is used.
OWN_MODELS = entry_points(group="ajgdata.models")
_BASELINES = "ajgdata.models.baselines"
MODELS = Registry(
    "model",
    {
        "cnn": Model("ajgdata.models.cnn:cnn", "CNN", _NETWORK, extra="cnn"),
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
        "cnn_per_bin": Model(
            "ajgdata.models.cnn:cnn_per_bin", "CNN, scale per bin", _NETWORK, extra="cnn"
        ),
        "covariates_alone": Model("ajgdata.models.inputs:covariates_alone", "covariates alone"),
    },
)
#: Models that share one job, because measuring one of them takes about as long as starting a job.
PLAIN_MODELS = (
    "linear",
    "ridge",
    "knn",
    "linear_plain",
    "ridge_plain",
    "knn_plain",
    "covariates_alone",
)
#: The model of the paper, and its baseline with a published value.
PAPER_MODEL = "cnn"
BASELINE = "knn_plain"
#: The model without the feature, which every task with covariates also has.
COVARIATES_ALONE = "covariates_alone"
for _point in OWN_MODELS:
    MODELS.add(_point.name, Model(_point.value, _point.name, several=False), _point)


def model_label(name: str, kind: Kind) -> str:
    """Return the name that the report gives a model; an unknown name is returned unchanged."""
    return MODELS[name].label(kind) if name in MODELS else name
