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
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from ajgdata.experiments.base import TOGETHER, Experiment, MeasuredPart
from ajgdata.models import model_label
from ajgdata.store.code_hash import CodeSource, used_sources, with_own_imports
from ajgdata.store.files import line_of
from ajgdata.store.provenance import PACKAGE
from ajgdata.types import CROSS_VALIDATION, DataError, DatasetSpec, Kind, describe, location
from ajgdata.types.registry import Registry
from ajgdata.types.session import PLACEMENT_COLUMN

#: Data set, task or embedding, experiment, and name of the part (see `MeasuredPart`).
MeasurementKey = tuple[str, str, str, str]
#: Data set, task or embedding, experiment, and name of a job.
JobKey = tuple[str, str, str, str]
#: Experiments whose folds hold out one placement of every class.
BY_PLACEMENT = (CROSS_VALIDATION, "variants", "repeated_fits")
#: Modules of this package that are not experiments.
SHARED_MODULES = (
    "base",
    "cross_validation_paper",
    "cross_validation_results",
    "embedding",
    "hypotheses",
    "plots",
    "scores",
    "silence_tests",
    "variant_data",
    "variant_figures",
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
    """An experiment that a task, or an embedding (whose name is then `task`), asks for."""

    experiment: Experiment
    dataset: str
    task: str
    settings: Any
    parts: tuple[MeasuredPart, ...]

    @property
    def test_sets(self) -> tuple[str, ...]:
        """Return the data sets that it tests on in addition to its own, the setting `test_on`."""
        return tuple(getattr(self.settings, "test_on", ()))

    @property
    def other_sets(self) -> tuple[str, ...]:
        """Return all data sets that it needs in addition to its own: those that it tests or trains
        on, and the placebo."""
        named = [*self.test_sets, *getattr(self.settings, "train_on", ())]
        placebo = getattr(self.settings, "placebo", None)
        if placebo is not None:
            named.append(placebo)
        return tuple(dict.fromkeys(named))

    @property
    def other_tasks(self) -> tuple[str, ...]:
        """Return the other tasks of the data set whose settings it needs."""
        return tuple(getattr(self.settings, "other_tasks", ()))

    def label(self, part: MeasuredPart, kind: Kind) -> str:
        """Return the name of a part for people; "" if everything is measured together."""
        if part.name == "":
            return ""
        return part.title or model_label(part.name, kind)

    @property
    def keys(self) -> list[MeasurementKey]:
        """Return the key of each of its measurements."""
        return [self._key(part.name) for part in self.parts]

    @property
    def jobs(self) -> list[JobKey]:
        """Return the key of each of its jobs."""
        return [self._key(name) for name in dict.fromkeys(part.job for part in self.parts)]

    def _key(self, name: str) -> tuple[str, str, str, str]:
        """Return the key of a part or of a job."""
        return self.dataset, self.task, self.experiment.name, name

    @property
    def part_names(self) -> list[str]:
        """Return the names of its parts."""
        return [part.name for part in self.parts]

    def of_job(self, name: str) -> Request:
        """Return what one of its jobs measures, with the settings of this job alone."""
        return self.only([part.name for part in self.parts if part.job == name])

    def only(self, names: Sequence[str]) -> Request:
        """Return the measurement of some parts, with their own settings."""
        settings = self.experiment.division.only(self.settings, names)
        parts = tuple(part for part in self.parts if part.name in names)
        return replace(self, parts=parts, settings=settings)

    def with_parts(self, parts: Iterable[MeasuredPart]) -> Request:
        """Return the request with some of its parts, and all its settings."""
        return replace(self, parts=tuple(parts))

    def job_settings(self) -> dict[str, Any]:
        """Return its settings as JSON has them, for a job of the workflow."""
        settings: dict[str, Any] = self.settings.model_dump(mode="json", exclude={"optional"})
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
            Request(experiment, spec.name, task, settings, (TOGETHER,))
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
    parts = tuple(experiment.division.parts(settings))
    return Request(experiment, spec.name, task, settings, parts)


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
