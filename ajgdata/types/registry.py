"""Registries of what a data set config may name: models and robots, ours and those of installed
packages.

This is the one list of them: choices in dataset.yaml, labels in the report, the types that a
model's file may hold, documentation and contract tests all follow from it. A package adds its own
by an entry point, e.g. `[project.entry-points."ajgdata.models"]`. To check a name only the metadata
of installed packages is read; what it stands for is imported when it is used.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pkgutil import resolve_name
from typing import Any, Generic, Literal, TypeVar

Kind = Literal["regression", "classification"]


@dataclass(frozen=True)
class Model:
    """A model that a task may name.

    `make` is `module:function`, called with (kind, seed) for an unfitted scikit-learn estimator;
    `classification` and `regression` are its names in the report. `several` says whether its
    regressor fits targets (n, k), too. `trusted` are the types in its file that belong neither to
    scikit-learn nor to NumPy (`module.Class`): without being named they are not loaded. `plain`
    names the model that it is beside when nothing is chosen for it; "" for one that is not tuned.
    With more than `most_recordings`, it is trained on an even subset (None: on all).
    """

    make: str
    classification: str
    regression: str
    several: bool = True
    trusted: tuple[str, ...] = ()
    plain: str = ""
    most_recordings: int | None = None

    def label(self, kind: Kind) -> str:
        """Return its name in the report."""
        return self.classification if kind == "classification" else self.regression


@dataclass(frozen=True)
class RobotMaker:
    """A robot that a protocol may name.

    `open` is `module:function`: a context manager, called with (settings, confirm) that yields a
    Robot (see `acquire.robot`). `settings` are the protocol's `robot_settings`; `confirm(text)`
    says something to the person and waits for Enter.
    """

    open: str


Entry = TypeVar("Entry")


class Registry(Generic[Entry]):
    """Entries by name: ours, and those that installed packages register under `group`.

    Of two of one name ours counts.
    """

    def __init__(self, noun: str, group: str, own: Mapping[str, Entry]) -> None:
        self.noun, self.group, self.own = noun, group, dict(own)

    def names(self) -> list[str]:
        """Return every name: ours in their order, then the others sorted."""
        return [*self.own, *sorted(set(self._registered()) - set(self.own))]

    def checked(self, name: str) -> str:
        """Return `name`. Raises ValueError, which lists the names, if nothing has it."""
        if name not in self.own and name not in self._registered():
            known = ", ".join(self.names())
            raise ValueError(f"unknown {self.noun} {name!r}: choose one of {known}")
        return name

    def __getitem__(self, name: str) -> Entry:
        """Return the entry, imported now. Raises ValueError if there is none or it is broken."""
        if self.checked(name) in self.own:
            return self.own[name]
        entry = resolve(self._registered()[name].value)
        kind = type(next(iter(self.own.values())))
        if not isinstance(entry, kind):
            raise ValueError(f"{self.noun} {name!r} of {self.origin(name)} is no {kind.__name__}")
        return entry

    def origin(self, name: str) -> str:
        """Return the package and version that registers `name`; "" for ours."""
        if self.checked(name) in self.own:
            return ""
        package = self._registered()[name].dist
        return f"{package.name} {package.version}" if package else name

    def _registered(self) -> dict[str, EntryPoint]:
        return _entry_points(self.group, tuple(sys.path))


@cache
def _entry_points(group: str, path: tuple[str, ...]) -> dict[str, EntryPoint]:
    """Return entry points by name; read once, since that takes some 10 ms (again if `path`
    changes)."""
    return {point.name: point for point in entry_points(group=group)}


def resolve(place: str) -> Any:
    """Return what `module:name` names. Raises ValueError, in one line, if it cannot be imported."""
    try:
        return resolve_name(place)
    except Exception as error:  # an import of another package's module runs what it likes
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise ValueError(f"{place} cannot be imported ({reason}): mend or remove it") from None


#: Types in the files of our models that skops does not know to be harmless.
_TRUSTED = (
    "ajgdata.models.baselines.Compress",
    "ajgdata.models.scaling.AtLeast",
    "ajgdata.models.scaling.OneScale",
    "sklearn.tree._tree.Tree",
    "sklearn.ensemble._hist_gradient_boosting.predictor.TreePredictor",
    "sklearn.neural_network._stochastic_optimizers.AdamOptimizer",
    "sklearn.metrics._dist_metrics.ManhattanDistance64",
    # of up to 15 features, as after a projection of few recordings
    "sklearn.metrics._dist_metrics.EuclideanDistance64",
    "sklearn.neighbors._kd_tree.KDTree",
)
#: Recordings that models are trained on at most: the kernel of support vectors and the neighbours
#: of k-NN cost as their square, networks take more than one step for each, and others hold the
#: features three times in float64 (25 kB each).
_SVM, _NETWORK, _KNN, _OTHER = 5_000, 10_000, 20_000, 30_000


def _model(
    make: str,
    label: str,
    most: int = _OTHER,
    *,
    regression: str = "",
    several: bool = True,
    plain: str = "",
) -> Model:
    """Return a model of ours; `regression` is its name for numbers, if it has another one."""
    make = f"ajgdata.models.{make}"
    return Model(make, label, regression or label, several, _TRUSTED, plain, most)


MODELS = Registry(
    "model",
    "ajgdata.models",
    {
        "cnn": _model("cnn:cnn", "CNN", _NETWORK),
        "linear": _model(
            "candidates:linear", "logistic regression", regression="ridge", plain="linear_plain"
        ),
        "ridge": _model(
            "candidates:ridge", "ridge classifier", regression="ridge", plain="ridge_plain"
        ),
        "knn": _model("candidates:nearest_neighbours", "k-NN", _KNN, plain="knn_plain"),
        "svm": _model("candidates:support_vectors", "SVM", _SVM, several=False, plain="svm_plain"),
        "boosting": _model("baselines:boosting", "gradient boosting", several=False),
        "forest": _model("baselines:forest", "random forest"),
        "mlp": _model("baselines:perceptron", "MLP", _NETWORK),
        "linear_plain": _model(
            "baselines:logistic", "logistic regression, plain", regression="ridge, plain"
        ),
        "ridge_plain": _model(
            "baselines:ridge", "ridge classifier, plain", regression="ridge, plain"
        ),
        "knn_plain": _model("baselines:nearest_neighbours", "k-NN, plain", _KNN),
        "svm_plain": _model("baselines:support_vectors", "SVM, plain", _SVM, several=False),
        "cnn_one_scale": _model("cnn:cnn_one_scale", "CNN, one scale", _NETWORK),
    },
)
ROBOTS = Registry(
    "robot",
    "ajgdata.robots",
    {
        "manual": RobotMaker("ajgdata.acquire.robot:open_manual"),
        "command": RobotMaker("ajgdata.acquire.robot:open_command"),
    },
)
