"""Experiments that tasks and embeddings of data sets request, divided into jobs.

Light: Snakemake imports this.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from ajgdata.experiments.division import TOGETHER, ByModel, MeasuredPart
from ajgdata.experiments.registry import EXPERIMENTS
from ajgdata.experiments.spec import ExperimentSpec
from ajgdata.store.files import line_of
from ajgdata.types import (
    CROSS_VALIDATION,
    Augment,
    DataError,
    DatasetSpec,
    Kind,
    describe,
    location,
)
from ajgdata.types.registry import model_label
from ajgdata.types.session import PLACEMENT_COLUMN

#: Data set, and task or embedding.
TaskKey = tuple[str, str]
#: Data set, task or embedding, experiment, and name of the part (see `MeasuredPart`).
MeasurementKey = tuple[str, str, str, str]
#: Data set, task or embedding, experiment, and name of a job.
JobKey = tuple[str, str, str, str]


@dataclass(frozen=True)
class Request:
    """An experiment that a task, or an embedding (whose name is then `task`), asks for.

    `augment` are the copies of the task, if the experiment trains on them.
    """

    experiment: ExperimentSpec
    dataset: str
    task: str
    settings: Any
    parts: tuple[MeasuredPart, ...]
    augment: Augment | None = None

    @property
    def job_type(self) -> str:
        """Return the type of its jobs in `store.code_hash`."""
        return "experiment with copies" if self.augment else self.experiment.job_type

    @property
    def test_sets(self) -> tuple[str, ...]:
        """Return the data sets that it tests on in addition to its own, the setting `test_on`."""
        return tuple(getattr(self.settings, "test_on", ()))

    @property
    def required_sets(self) -> tuple[str, ...]:
        """Return all data sets that it needs in addition to its own: `other_sets`, and the data set
        whose recordings are the noise of copies."""
        if self.augment is None or not self.augment.noise_set:
            return self.other_sets
        return tuple(dict.fromkeys((*self.other_sets, self.augment.noise_set)))

    @property
    def other_sets(self) -> tuple[str, ...]:
        """Return the other data sets whose features it compares with its own: those that it tests
        or trains on, and the placebo."""
        named = [*self.test_sets, *getattr(self.settings, "train_on", ())]
        placebo = getattr(self.settings, "placebo", None)
        if placebo is not None:
            named.append(placebo)
        return tuple(dict.fromkeys(named))

    @property
    def first_sets(self) -> tuple[str, ...]:
        """Return the other data sets that its parts need before `snakemake everything`."""
        names = [part.name for part in self.parts if not part.is_late]
        return self.only(names).required_sets if names else ()

    @property
    def other_tasks(self) -> tuple[str, ...]:
        """Return the other tasks of the data set whose settings it needs."""
        return tuple(getattr(self.settings, "other_tasks", ()))

    @property
    def models(self) -> tuple[str, ...] | None:
        """Return the models that its parts are, or None if its parts are no models."""
        if not isinstance(self.experiment.division, ByModel):
            return None
        return tuple(self.part_names)

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
    return Request(experiment, spec.name, task, settings, parts, spec.tasks[task].augment)


def _check(spec: DatasetSpec, task: str, experiment: ExperimentSpec, settings: Any) -> None:
    """Raise ValueError for settings that the task cannot have."""
    target = spec.targets[spec.tasks[task].target]
    kind = target.kind
    if kind not in experiment.kinds:
        raise ValueError(f"experiments.{experiment.name} is for {experiment.kinds[0]}, not {kind}")
    if target.columns and not experiment.vectors:
        raise ValueError(f"experiments.{experiment.name} is not for a target with columns")
    if spec.tasks[task].groups == PLACEMENT_COLUMN and not experiment.by_placement:
        raise ValueError(
            f"experiments.{experiment.name} has no folds of placements: use a task without "
            "`groups: placement_id`"
        )
    if spec.tasks[task].augment is not None and not experiment.augments:
        raise ValueError(
            f"experiments.{experiment.name} has no copies of recordings: use a task without "
            "`augment`"
        )
    if spec.tasks[task].balance and not experiment.balances:
        raise ValueError(
            f"experiments.{experiment.name} does not balance classes: use a task without `balance`"
        )
    if spec.tasks[task].covariates and not experiment.covariates:
        raise ValueError(
            f"experiments.{experiment.name} has no covariates: use a task without `covariates`"
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


def requests_for(specs: Mapping[str, DatasetSpec], tasks: Sequence[TaskKey]) -> list[Request]:
    """Return every experiment that tasks and embeddings ask for, in the order of the report.

    `specs` are the data sets of the run. Late parts that need other data sets are omitted.
    """
    requests = (r for dataset, task in tasks for r in requested_experiments(specs[dataset], task))
    possible = (_with_possible_parts(request, specs) for request in requests)
    return [request for request in possible if request.parts]


def _with_possible_parts(request: Request, specs: Mapping[str, DatasetSpec]) -> Request:
    """Return a request without the late parts that need data sets outside of the run."""
    parts = [
        part
        for part in request.parts
        if not part.is_late or set(request.only([part.name]).required_sets) <= set(specs)
    ]
    return request.with_parts(parts)


def of_paper(
    specs: Mapping[str, DatasetSpec], requests: Mapping[JobKey, Request]
) -> dict[JobKey, Request]:
    """Return the experiments that reproduce the paper: cross-validation and the named experiments
    of tasks with published values, and embeddings of data sets with such tasks."""
    return {key: r for key, r in requests.items() if _is_of_paper(specs[r.dataset], r)}


def _is_of_paper(spec: DatasetSpec, request: Request) -> bool:
    name = request.experiment.name
    if request.experiment.of_embedding:
        return any(task.papers for task in spec.tasks.values())
    papers = spec.tasks[request.task].papers
    compared = {part.partition(".")[0] for part in papers}
    return name in compared or (bool(papers) and name == CROSS_VALIDATION)


def without_late(requests: Mapping[JobKey, Request]) -> dict[JobKey, Request]:
    """Return the jobs of the first target if no result is of the paper: those that do not wait for
    `snakemake everything`."""
    return {
        key: request
        for key, request in requests.items()
        if not all(part.is_late for part in request.parts)
    }


def page_of(request: Request, spec: DatasetSpec) -> str:
    """Return the page of an experiment: its own, that of its task, or that of the data set."""
    if request.experiment.of_embedding:
        return request.experiment.name
    return spec.tasks[request.task].page or request.dataset
