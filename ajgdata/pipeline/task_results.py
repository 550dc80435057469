"""Stored measurements of experiments -> results of tasks, for tables and the report."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from ajgdata.evaluate.mirror import mirror_plane
from ajgdata.experiments.base import Other, Result, TaskResults
from ajgdata.experiments.requests import MeasurementKey, Request, page_of
from ajgdata.gripper import Scene
from ajgdata.paths import Paths
from ajgdata.report.comparison import PaperFigure
from ajgdata.store.tables import read_measurements
from ajgdata.types import CROSS_VALIDATION, DataError, DatasetSpec
from ajgdata.types.table import Table


class Measurement(NamedTuple):
    """What an experiment measured of a task, with one model: facts, tables, and tables of cost."""

    about: dict[str, Any]
    tables: list[Table]
    cost: list[Table]


def measurements(
    paths: Paths, requests: Sequence[Request]
) -> tuple[dict[MeasurementKey, Measurement], dict[Path, DataError]]:
    """Return the existing measurements of experiments, and the errors of files that cannot be read,
    for example because they are of another version, by file."""
    available = {}
    errors = {}
    for job in (job for request in requests for job in request.jobs):
        files = paths.experiment(*job), paths.experiment_cost(*job)
        if all(file.is_file() for file in files):
            contents = []
            for file in files:
                try:
                    contents.append(read_measurements(file))
                except DataError as error:
                    errors[file] = error
            if len(contents) < len(files):
                continue
            results, costs = contents
            for (about, tables), (_, cost) in zip(results, costs, strict=True):
                key = about["dataset"], about["task"], about["experiment"], about["model"]
                available[key] = Measurement(about, tables, cost)
    return available, errors


def computed(requests: Sequence[Request], available: Collection[MeasurementKey]) -> list[Request]:
    """Return the experiments that have measurements among `available`, each with these parts."""
    measured = []
    for request in requests:
        pairs = zip(request.parts, request.keys, strict=True)
        parts = [part for part, key in pairs if key in available]
        if parts:
            measured.append(request.with_parts(parts))
    return measured


def read_results(
    available: Mapping[MeasurementKey, Measurement],
    request: Request,
    specs: Mapping[str, DatasetSpec],
    paper: Mapping[str, PaperFigure],
) -> tuple[TaskResults, list[tuple[str, str]]]:
    """Return the results of an experiment on a task among those available, and the label of each
    model that was skipped, with the reason."""
    spec = specs[request.dataset]
    task_settings = spec.task_settings(request.task)
    results = []
    skipped = []
    source = "recorded"
    for part, key in zip(request.parts, request.keys, strict=True):
        about, tables, costs = available[key]
        label = request.label(part, task_settings.kind)
        source = about["provenance"]["source"]
        if "skipped" in about:
            skipped.append((label, about["skipped"]))
        else:
            named, cost = ({t.name: t for t in some} for some in (tables, costs))
            results.append(Result(part.name, label, about, named, cost))
            if request.experiment.name == CROSS_VALIDATION:
                tests = about.get("others", {})
                skipped += [(f"{label}, {test}", reason) for test, reason in tests.items()]
    return TaskResults(
        experiment=request.experiment.name,
        dataset=spec.name,
        dataset_title=spec.title or spec.name,
        task=request.task,
        task_settings=task_settings,
        source="simulated" if source == "simulated" else "recorded",
        page=page_of(request, spec),
        settings=request.settings,
        results=tuple(results),
        papers={part: paper[name] for part, name in _papers(request, specs, paper).items()},
        other_sets={
            n: Other(specs[n].title or n, specs[n].level) for n in request.other_sets if n in specs
        },
        level=spec.level,
        mirror_deg=_mirror_deg(spec, task_settings.target),
        left_out=results[0].about.get("left_out", {}) if results else {},
    ), skipped


def _mirror_deg(spec: DatasetSpec, target: str) -> float | None:
    """Return the angle of the mirror plane of a simulated gripper, if it is known.

    It is known if the target is the angle of the object in the recipe.
    """
    if spec.recipe is None:
        return None
    angles = [
        (item.targets.get(target), item.grasp.get("angle_deg")) for item in spec.recipe.objects
    ]
    if any(angle is None or value != angle for value, angle in angles):
        return None
    return mirror_plane(Scene.model_validate(spec.recipe.scene).gripper).angle_deg


def _papers(
    request: Request, specs: Mapping[str, DatasetSpec], paper: Mapping[str, PaperFigure]
) -> Mapping[str, str]:
    """Return the published values that results are compared with, by part.

    An embedding is compared if a task of its data set is.
    """
    experiment, spec = request.experiment, specs[request.dataset]
    if not experiment.of_embedding:
        return spec.tasks[request.task].papers
    named = [task.papers for task in spec.tasks.values()]
    return {experiment.name: experiment.paper} if experiment.paper in paper and any(named) else {}
