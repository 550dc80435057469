"""Experiments on tasks and embeddings: the registry, and what they ask for. Light: Snakemake
imports it.

Every module of this package is an experiment, but for those that experiments share. Installed
packages add experiments by entry points (docs/examples/own_experiment_package).
"""

from __future__ import annotations

import functools
import importlib
import inspect
import pkgutil
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from ajgdata.experiments.base import Experiment
from ajgdata.models import model_label
from ajgdata.store.code_hash import CodeSource, used_sources, with_own_imports
from ajgdata.store.files import line_of
from ajgdata.store.provenance import PACKAGE
from ajgdata.types import CROSS_VALIDATION, DataError, DatasetSpec, Kind, describe, location
from ajgdata.types.registry import PLAIN_MODELS, Registry
from ajgdata.types.session import PLACEMENT_COLUMN

#: Data set, task or embedding, experiment, and model ("": all models together).
MeasurementKey = tuple[str, str, str, str]
#: Data set, task or embedding, experiment, and name of a job.
JobKey = tuple[str, str, str, str]
#: Experiments whose folds hold out one placement of every class.
BY_PLACEMENT = (CROSS_VALIDATION, "comparison", "repeated_fits")
PLAIN_JOB, ALL_JOB = "plain", "all"  #: names of jobs of several models
#: Modules of this package that are not experiments.
SHARED_MODULES = (
    "base",
    "cross_validation_paper",
    "cross_validation_results",
    "embedding",
    "plots",
    "scores",
    "silence_tests",
)


def _all() -> Registry[Experiment]:
    names = sorted({module.name for module in pkgutil.iter_modules(__path__)} - {*SHARED_MODULES})
    built_in = [importlib.import_module(f"{__name__}.{name}").EXPERIMENT for name in names]
    experiments = Registry("experiment", {experiment.name: experiment for experiment in built_in})
    for point in entry_points(group="ajgdata.experiments"):
        own = point.load()
        if not inspect.isfunction(inspect.unwrap(own.measure)):
            problem = f"`measure` of the experiment {own.name!r} is not a function"
            raise ImportError(f"package {point.module}: {problem}")
        experiments.add(own.name, own, point)
    return experiments


EXPERIMENTS = _all()


@dataclass(frozen=True)
class Request:
    """An experiment that a task, or an embedding (whose name is then `task`), asks for.

    `models` are ("",) if all are measured together.
    """

    experiment: Experiment
    dataset: str
    task: str
    settings: Any
    models: tuple[str, ...]

    @property
    def test_sets(self) -> tuple[str, ...]:
        """Return the data sets that it tests on in addition to its own, the setting `test_on`."""
        return tuple(getattr(self.settings, "test_on", ()))

    @property
    def other_sets(self) -> tuple[str, ...]:
        """Return all data sets that it needs in addition to its own: test sets, and the placebo."""
        placebo = getattr(self.settings, "placebo", None)
        return self.test_sets if placebo is None else (*self.test_sets, placebo)

    def label(self, model: str, kind: Kind) -> str:
        """Return the name of a measurement for people: a model, or a comparison."""
        titles = getattr(self.settings, "titles", {})
        return titles.get(model) or (model_label(model, kind) if model else "")

    @property
    def keys(self) -> list[MeasurementKey]:
        """Return the key of each of its measurements."""
        return [(self.dataset, self.task, self.experiment.name, model) for model in self.models]

    @property
    def job_models(self) -> dict[str, list[str]]:
        """Return the models of each of its jobs, by the name of the job.

        All plain models share the job PLAIN_JOB; models that are measured together have ALL_JOB.
        """
        jobs: dict[str, list[str]] = {}
        for model in self.models:
            is_plain = model in PLAIN_MODELS and not hasattr(self.settings, "only")
            name = PLAIN_JOB if is_plain else model or ALL_JOB
            jobs.setdefault(name, []).append(model)
        return jobs

    @property
    def jobs(self) -> list[JobKey]:
        """Return the key of each of its jobs."""
        return [(self.dataset, self.task, self.experiment.name, name) for name in self.job_models]

    def job_settings(self, name: str) -> dict[str, Any]:
        """Return the settings of a job as in JSON; `models` has only its own models."""
        models = self.job_models[name]
        only = self.settings.only(models[0]) if hasattr(self.settings, "only") else self.settings
        settings = only.model_dump(mode="json", exclude={"optional"})
        if self.experiment.by_model and "models" in settings:
            settings["models"] = models
        return settings


def measurement_name(experiment: str, model: str) -> str:
    """Return the name of a measurement for people; `model` is "" if it has all models."""
    return f"{experiment} of {model}" if model else experiment


class SettingsError(ValueError):
    """Settings of an experiment that are wrong, with the keys that lead to them in dataset.yaml."""

    def __init__(self, message: str, keys: tuple[int | str, ...]) -> None:
        super().__init__(message)
        self.keys = keys


def requested_experiments(spec: DatasetSpec, task: str) -> list[Request]:
    """Return what a task, or an embedding of that name, asks for, in the order of the report.

    Raises SettingsError for an unknown experiment and wrong settings.
    """
    if task in spec.embeddings:
        settings = spec.embeddings[task]
        requests = [
            Request(experiment, spec.name, task, settings, ("",))
            for experiment in EXPERIMENTS.values()
            if experiment.of_embedding
        ]
    else:
        requests = [_request(spec, task, name) for name in spec.tasks[task].requested]
    return sorted(requests, key=lambda request: (request.experiment.order, request.experiment.name))


def _request(spec: DatasetSpec, task: str, name: str) -> Request:
    """Return the experiment `name` of a task with its settings, or raise SettingsError."""
    keys = ("tasks", task, *(("experiments", name) if name != CROSS_VALIDATION else ()))
    try:
        if name not in EXPERIMENTS:
            known = {n for n, e in EXPERIMENTS.items() if not e.of_embedding} - {CROSS_VALIDATION}
            raise ValueError(f"no experiment {name!r}: there are {', '.join(sorted(known))}")
        experiment = EXPERIMENTS[name]
        if experiment.of_embedding:
            raise ValueError(f"experiments.{name} is for embeddings: declare it there")
        settings: Any = experiment.settings.model_validate(spec.tasks[task].requested[name])
        _check(spec, task, experiment, settings)
    except ValidationError as error:
        problem = f"task {task}: experiments.{name}: {describe(error, '').problem}"
        raise SettingsError(problem, (*keys, *location(error))) from None
    except ValueError as error:
        raise SettingsError(f"task {task}: {error}", keys) from None
    models = tuple(settings.models) if experiment.by_model else ("",)
    return Request(experiment, spec.name, task, settings, models)


def _check(spec: DatasetSpec, task: str, experiment: Experiment, settings: Any) -> None:
    """Raise ValueError for settings that the task cannot have."""
    kind = spec.targets[spec.tasks[task].target].kind
    if kind not in experiment.kinds:
        raise ValueError(f"experiments.{experiment.name} is for {experiment.kinds[0]}, not {kind}")
    if spec.tasks[task].groups == PLACEMENT_COLUMN and experiment.name not in BY_PLACEMENT:
        raise ValueError(
            f"experiments.{experiment.name} has no folds of placements: use a task without "
            "`groups: placement_id`"
        )
    experiment.check(settings, kind, spec.features)
    for key in listing_keys(experiment.settings):
        listed = getattr(settings, key)
        repeated = [value for value in listed if listed.count(value) > 1]
        if repeated:
            raise ValueError(f"experiments.{experiment.name}.{key} lists {repeated[0]} twice")


def listing_keys(settings: type[BaseModel]) -> list[str]:
    """Return the keys of settings whose value is a list of any length."""
    return [key for key, f in settings.model_fields.items() if Ellipsis in get_args(f.annotation)]


def all_requests(spec: DatasetSpec, path: Path) -> Iterator[Request]:
    """Yield every experiment that the tasks and embeddings of a data set ask for.

    Raises DataError with the line in `path`, its dataset.yaml, for settings that are wrong.
    """
    for task in (*spec.tasks, *spec.embeddings):
        try:
            yield from requested_experiments(spec, task)
        except SettingsError as error:
            where = f"{path}:{line_of(path, error.keys)}"
            raise DataError(where, str(error), "correct it, or remove it") from None


@functools.cache
def measuring_half(name: str) -> tuple[CodeSource, ...]:
    """Return the sources that decide what an experiment measures.

    An edit of its drawing half changes no result.
    """
    return used_sources(EXPERIMENTS[name].measure)


def own_experiment_files() -> list[Path]:
    """Return the files of experiments of other packages, with what they import from there."""
    functions = [inspect.unwrap(experiment.measure) for experiment in EXPERIMENTS.values()]
    own = [f for f in functions if f.__module__.partition(".")[0] != PACKAGE.name]
    return with_own_imports(Path(str(inspect.getsourcefile(function))) for function in own)
