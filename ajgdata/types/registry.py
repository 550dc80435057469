"""Registries of what a declaration may name: models, sources and robots, ours and those of
installed packages.

This is the one list of them: choices in dataset.yaml, labels in the report, the types that a
model's file may hold, documentation and contract tests all follow from it. A package adds its own
by an entry point, e.g. `[project.entry-points."ajgdata.models"]`. To check a name only the metadata
of installed packages is read; what it stands for is imported when it is used.
"""

from __future__ import annotations

import re
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
class SourceMaker:
    """A source of recordings that a recipe may name.

    `open` is `module:function`: a context manager, called with (folder, cores) where `folder`
    keeps what the source wants to find again, that yields a function (setup, signal, excitation)
    -> Source (see `acquire.source`). It is called for each session with the setup of its first
    grasp, the recipe's `signal` and the data set's `excitation` (`ExcitationSpec`).
    """

    open: str


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

    def __init__(self, noun: str, group: str, kind: type[Entry], own: Mapping[str, Entry]) -> None:
        self.noun, self.group, self.kind, self.own = noun, group, kind, dict(own)

    def names(self) -> list[str]:
        """Return every name: ours in their order, then the others sorted."""
        return [*self.own, *sorted(set(self._registered()) - set(self.own))]

    def checked(self, name: str) -> str:
        """Return `name`. Raises ValueError, which lists the names, if nothing has it."""
        if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
            raise ValueError(f"{self.noun} {name!r}: names are small letters, digits and _")
        if name not in self.own and name not in self._registered():
            known = ", ".join(self.names())
            raise ValueError(f"unknown {self.noun} {name!r}: choose one of {known}")
        return name

    def __getitem__(self, name: str) -> Entry:
        """Return the entry, imported now. Raises ValueError if there is none or it is broken."""
        if self.checked(name) in self.own:
            return self.own[name]
        point, *others = self._registered()[name]
        where = f"{self.noun} {name!r} of {_package(point)}"
        if others:
            raise ValueError(f"{where} is also of {_package(others[0])}: uninstall one of them")
        try:
            entry = point.load()
        except Exception as error:  # whatever somebody else's module does while it is imported
            reason = " ".join(f"{type(error).__name__}: {error}".split())
            raise ValueError(f"{where} cannot be imported ({reason}): mend or remove it") from None
        if not isinstance(entry, self.kind):
            raise ValueError(f"{where} is of type {type(entry).__name__}, not {self.kind.__name__}")
        return entry

    def origin(self, name: str) -> str:
        """Return the package and version that registers `name`; "" for ours."""
        return "" if self.checked(name) in self.own else _package(self._registered()[name][0])

    def _registered(self) -> dict[str, list[EntryPoint]]:
        return _entry_points(self.group, tuple(sys.path))


@cache
def _entry_points(group: str, path: tuple[str, ...]) -> dict[str, list[EntryPoint]]:
    """Return entry points by name; read once, since that takes some 10 ms (again if `path`
    changes)."""
    points: dict[str, list[EntryPoint]] = {}
    for point in entry_points(group=group):
        points.setdefault(point.name, []).append(point)
    return points


def _package(point: EntryPoint) -> str:
    return f"{point.dist.name} {point.dist.version}" if point.dist else point.value


def resolve(place: str) -> Any:
    """Return what `module:name` names. Raises ValueError, in one line, if it cannot be imported."""
    try:
        return resolve_name(place)
    except Exception as error:  # as above: an import runs what it likes
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise ValueError(f"{place} cannot be imported ({reason}): mend or remove it") from None


_SCALED = (
    "ajgdata.models.baselines.Compress",
    "ajgdata.models.scaling.AtLeast",
    "ajgdata.models.scaling.OneScale",
)
_TREES = (*_SCALED, "sklearn.tree._tree.Tree")
_BOOSTED = (*_SCALED, "sklearn.ensemble._hist_gradient_boosting.predictor.TreePredictor")
_ADAM = (*_SCALED, "sklearn.neural_network._stochastic_optimizers.AdamOptimizer")
# sorts of scikit-learn's own that skops does not know to be harmless
_METRICS = (
    *_SCALED,
    "sklearn.metrics._dist_metrics.ManhattanDistance64",
    # of up to 15 features, as after a projection of few recordings
    "sklearn.metrics._dist_metrics.EuclideanDistance64",
    "sklearn.neighbors._kd_tree.KDTree",
)


#: Recordings that models are trained on at most: the kernel of support vectors and the neighbours
#: of k-NN cost as their square, networks take more than one step for each, and others hold the
#: features three times in float64 (25 kB each).
_SVM, _NETWORK, _KNN, _OTHER = 5_000, 10_000, 20_000, 30_000


def _baseline(
    function: str,
    classification: str,
    regression: str,
    most: int = _OTHER,
    *,
    several: bool = True,
    trusted: tuple[str, ...] = _SCALED,
) -> Model:
    make = f"ajgdata.models.baselines:{function}"
    return Model(make, classification, regression, several, trusted, most_recordings=most)


def _tuned(
    function: str,
    classification: str,
    regression: str,
    plain: str,
    most: int = _OTHER,
    *,
    several: bool = True,
    trusted: tuple[str, ...] = _SCALED,
) -> Model:
    make = f"ajgdata.models.candidates:{function}"
    return Model(make, classification, regression, several, trusted, plain, most)


def _cnn(function: str, label: str) -> Model:
    return Model(f"ajgdata.models.cnn:{function}", label, label, most_recordings=_NETWORK)


MODELS = Registry(
    "model",
    "ajgdata.models",
    Model,
    {
        "cnn": _cnn("cnn", "CNN"),
        "linear": _tuned("linear", "logistic regression", "ridge", "linear_plain"),
        "ridge": _tuned("ridge", "ridge classifier", "ridge", "ridge_plain"),
        "knn": _tuned("nearest_neighbours", "k-NN", "k-NN", "knn_plain", _KNN, trusted=_METRICS),
        "svm": _tuned("support_vectors", "SVM", "SVM", "svm_plain", _SVM, several=False),
        "boosting": _baseline(
            "boosting", "gradient boosting", "gradient boosting", several=False, trusted=_BOOSTED
        ),
        "forest": _baseline("forest", "random forest", "random forest", trusted=_TREES),
        "mlp": _baseline("perceptron", "MLP", "MLP", _NETWORK, trusted=_ADAM),
        "linear_plain": _baseline("logistic", "logistic regression, plain", "ridge, plain"),
        "ridge_plain": _baseline("ridge", "ridge classifier, plain", "ridge, plain"),
        "knn_plain": _baseline(
            "nearest_neighbours", "k-NN, plain", "k-NN, plain", _KNN, trusted=_METRICS
        ),
        "svm_plain": _baseline("support_vectors", "SVM, plain", "SVM, plain", _SVM, several=False),
        "cnn_one_scale": _cnn("cnn_one_scale", "CNN, one scale"),
    },
)
SOURCES = Registry(
    "source",
    "ajgdata.sources",
    SourceMaker,
    {"virtual": SourceMaker("ajgdata.acquire.virtual:open_virtual")},
)
ROBOTS = Registry(
    "robot",
    "ajgdata.robots",
    RobotMaker,
    {
        "manual": RobotMaker("ajgdata.acquire.robot:open_manual"),
        "command": RobotMaker("ajgdata.acquire.robot:open_command"),
    },
)
