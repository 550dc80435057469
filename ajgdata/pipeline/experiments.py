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
        by_model = {
            "curves": (settings.curve, paths.curve),
            "sorting": (settings.sorting, paths.sorting),
            "transfers": (settings.calibrate, paths.transfer),
        }
        by_task = {
            "permutations": (settings.permutations, paths.permutations),
            "stft": (settings.stft, paths.stft),
            "energies": (settings.energy, paths.energies),
        }
        for kind, (asked, path) in by_model.items():
            for model in asked.models if asked else ():
                found.append(Document(kind, dataset, task, model, path(dataset, task, model)))
        for kind, (wanted, path_of) in by_task.items():
            if wanted:
                found.append(Document(kind, dataset, task, "", path_of(dataset, task)))
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
