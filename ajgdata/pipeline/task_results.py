"""Stored measurements of experiments, and the results of tasks for tables and the report."""

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
    """One part of an experiment on a task, e.g. one model: facts, tables, and tables of cost."""

    about: dict[str, Any]
    tables: list[Table]
    cost: list[Table]


def measurements(
    paths: Paths, requests: Sequence[Request]
) -> tuple[dict[MeasurementKey, Measurement], dict[Path, DataError]]:
    """Return the existing measurements of experiments, and the errors of unreadable files, by file.

    A file is unreadable, for example, if another version of ajgdata wrote it.
    """
    available = {}
    errors = {}
    for request in requests:
        for job in request.jobs:
            files = paths.experiment(*job), paths.experiment_cost(*job)
            if not all(file.is_file() for file in files):
                continue
            contents = []
            for file in files:
                try:
                    contents.append(read_measurements(file))
                except DataError as error:
                    errors[file] = error
            if len(contents) < len(files):
                continue
            for (about, tables), (_, cost) in zip(*contents, strict=True):
                key = about["dataset"], about["task"], about["experiment"], about["model"]
                available[key] = Measurement(about, tables, cost)
    return available, errors


def computed(requests: Sequence[Request], available: Collection[MeasurementKey]) -> list[Request]:
    """Return the experiments that have `available` measurements, each with the measured parts."""
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
    """Return the available results of an experiment on a task, and its skipped parts.

    A skipped part has the label of its model, and the reason.
    """
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
            continue
        results.append(
            Result(
                model=part.name,
                label=label,
                about=about,
                tables={table.name: table for table in tables},
                cost={table.name: table for table in costs},
            )
        )
        if request.experiment.name == CROSS_VALIDATION:
            tests = about.get("others", {})
            skipped += [(f"{label}, {test}", reason) for test, reason in tests.items()]
    papers = _published_values(request, specs, paper)
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
        papers={part: paper[name] for part, name in papers.items()},
        other_sets={
            name: Other(specs[name].title or name, specs[name].level)
            for name in request.other_sets
            if name in specs
        },
        level=spec.level,
        mirror_deg=_mirror_deg(spec, task_settings.target),
        left_out=results[0].about.get("left_out", {}) if results else {},
    ), skipped


def _published_values(
    request: Request, specs: Mapping[str, DatasetSpec], paper: Mapping[str, PaperFigure]
) -> Mapping[str, str]:
    """Return the names of the published values that results are compared with, by part.

    An embedding is compared if a task of its data set is compared.
    """
    experiment = request.experiment
    spec = specs[request.dataset]
    if not experiment.of_embedding:
        return spec.tasks[request.task].papers
    has_comparison = any(task.papers for task in spec.tasks.values())
    if has_comparison and experiment.paper in paper:
        return {experiment.name: experiment.paper}
    return {}


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
