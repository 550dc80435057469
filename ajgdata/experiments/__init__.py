"""Experiments on tasks: the registry, and what a task asks for. Light: Snakemake imports it.

Built-in experiments are modules of this package. A package adds its own by an entry point of the
group `ajgdata.experiments`, whose name is the experiment's and whose object is an `Experiment`.
"""

from __future__ import annotations

import functools
import importlib
import pkgutil
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from pydantic import ValidationError

from ajgdata.experiments.base import Experiment
from ajgdata.types import DataError, DatasetSpec, describe

#: Modules of this package that experiments share.
SHARED = ("base", "embedding", "overview")
GROUP = "ajgdata.experiments"


@dataclass(frozen=True)
class Asked:
    """An experiment that a task asks for, with its settings; `models` are ("",) for all at once."""

    experiment: Experiment
    dataset: str
    task: str
    settings: Any
    models: tuple[str, ...]

    @property
    def others(self) -> tuple[str, ...]:
        """Return the data sets that it needs beside its own."""
        return tuple(getattr(self.settings, "test_on", ()))

    @property
    def kinds(self) -> tuple[str, ...]:
        """Return the names of its jobs: `learning_curve-cnn`, or `permutation_test`."""
        return tuple(
            f"{self.experiment.name}-{m}" if m else self.experiment.name for m in self.models
        )


@functools.cache
def _built_in() -> tuple[str, ...]:
    names = sorted(module.name for module in pkgutil.iter_modules(__path__))
    return tuple(name for name in names if name not in SHARED)


@functools.cache
def _plugins() -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=GROUP)}


def experiment_names() -> tuple[str, ...]:
    """Return the names of all experiments, built in and of other packages."""
    return (*_built_in(), *sorted(set(_plugins()) - set(_built_in())))


@functools.cache
def experiment(name: str) -> Experiment:
    """Return an experiment by name. Raises ValueError for an unknown or broken one."""
    if name in _built_in():
        return importlib.import_module(f"ajgdata.experiments.{name}").EXPERIMENT
    if name not in _plugins():
        known = ", ".join(experiment_names())
        raise ValueError(f"there is no experiment {name!r}: choose among {known}")
    entry = _plugins()[name]
    try:
        found = entry.load()
    except Exception as error:  # whatever another package's import raises
        raise ValueError(
            f"experiment {name!r} of {entry.value} cannot be loaded: {error}"
        ) from error
    if not isinstance(found, Experiment) or found.name != name:
        raise ValueError(f"{entry.value} is no Experiment called {name!r}: correct its entry point")
    return found


def asked_of(spec: DatasetSpec, task: str) -> list[Asked]:
    """Return the experiments that a task asks for, in the order of the report.

    Raises ValueError, naming task and key, for an unknown experiment and wrong settings.
    """
    found = {}
    for name, given in spec.tasks[task].asked.items():
        try:
            one = experiment(name)
            found[name] = _asked(spec, task, one, one.settings.model_validate(given))
        except ValidationError as error:
            complaint = describe(error, f"experiments.{name}")
            raise ValueError(f"task {task}: {complaint}") from None
        except ValueError as error:
            raise ValueError(f"task {task}: {error}") from None
    return sorted(found.values(), key=lambda one: (one.experiment.order, one.experiment.name))


def _asked(spec: DatasetSpec, task: str, one: Experiment, settings: Any) -> Asked:
    kind = spec.targets[spec.tasks[task].target].kind
    if kind not in one.kinds:
        raise ValueError(f"experiments.{one.name} is for {one.kinds[0]}, not for {kind}")
    one.check(settings, kind, spec.features)
    models = tuple(settings.models) if one.by_model else ("",)
    return Asked(one, spec.name, task, settings, models)


def all_asked(spec: DatasetSpec, where: object) -> Iterator[Asked]:
    """Yield every experiment that the tasks of a data set ask for.

    Raises DataError, naming `where`, for what cannot be made.
    """
    for task in spec.tasks:
        try:
            yield from asked_of(spec, task)
        except ValueError as error:
            raise DataError(where, f"tasks: {error}", "correct it, or remove it") from None


def measure_entry(name: str) -> str:
    """Return where the measuring half of an experiment is: what its results depend on."""
    if name in _built_in():
        return f"ajgdata.experiments.{name}:measure"
    measure = experiment(name).measure
    return f"{measure.__module__}:{measure.__name__}"
