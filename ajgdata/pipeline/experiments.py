"""What a run is asked for: evaluated models and further experiments, and who asks for them.

Called while Snakemake parses: light imports only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from ajgdata.paths import Paths
from ajgdata.types import DatasetSpec

Run = tuple[str, str, str]  #: data set, task, model
TaskKey = tuple[str, str]  #: data set, task


class Document(NamedTuple):
    """A further experiment on a task, and where its result is."""

    kind: str  #: as in `results/metrics.json`
    dataset: str
    task: str
    model: str  #: "" where none is named
    path: Path


def runs_of(specs: Mapping[str, DatasetSpec], tasks: Sequence[TaskKey]) -> list[Run]:
    """Every model that the tasks evaluate."""
    return [(d, task, model) for d, task in tasks for model in specs[d].tasks[task].models]


def documents_of(
    paths: Paths, specs: Mapping[str, DatasetSpec], tasks: Sequence[TaskKey]
) -> list[Document]:
    """Every further experiment that the tasks ask for."""
    found = []
    for dataset, task in tasks:
        settings = specs[dataset].tasks[task]
        place = dataset, task
        if settings.curve:
            for model in settings.curve.models:
                found.append(Document("curves", *place, model, paths.curve(*place, model)))
        if settings.permutations:
            found.append(Document("permutations", *place, "", paths.permutations(*place)))
        if settings.sorting:
            for model in settings.sorting.models:
                found.append(Document("sorting", *place, model, paths.sorting(*place, model)))
        if settings.calibrate:
            for model in settings.calibrate.models:
                found.append(Document("transfers", *place, model, paths.transfer(*place, model)))
        if settings.energy:
            found.append(Document("energies", *place, "", paths.energies(*place)))
    return found


def datasets_of(specs: Mapping[str, DatasetSpec], tasks: Sequence[TaskKey]) -> list[str]:
    """Data sets that the tasks are about, those that they are tested on included."""
    found = dict.fromkeys(dataset for dataset, _ in tasks)
    for dataset, task in tasks:
        found |= dict.fromkeys(specs[dataset].tasks[task].others)
    return list(found)


def experiments_of(specs: Mapping[str, DatasetSpec]) -> dict[str, list[TaskKey]]:
    """Tasks by the name of their experiment: that of their data set, unless they name some."""
    found: dict[str, list[TaskKey]] = {}
    for dataset, spec in specs.items():
        for name, task in spec.tasks.items():
            for experiment in task.experiments or (dataset,):
                found.setdefault(experiment, []).append((dataset, name))
    return found
