"""Experiments of a run: which are asked for, their measurement as a job, and their results.

Called while Snakemake parses, too: light imports only.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ajgdata.experiments import EXPERIMENTS, Asked, asked_of
from ajgdata.experiments.base import Experiment, Inputs, Other, Result, TaskResults
from ajgdata.features.spectrum import differing_axes
from ajgdata.models.device import device_facts
from ajgdata.paths import Paths
from ajgdata.pipeline.progress import tell
from ajgdata.store.features import read_store
from ajgdata.store.files import read_json
from ajgdata.store.tables import read_tables, write_tables
from ajgdata.types import (
    CROSS_VALIDATION,
    AudioSettings,
    DataError,
    DatasetSpec,
    FeatureSettings,
    NotPossibleError,
)

if TYPE_CHECKING:
    from ajgdata.report.comparison import PaperFigure
    from ajgdata.store.features import FeatureRows
    from ajgdata.types.table import Table

TaskKey = tuple[str, str]  #: data set, and task or embedding
JobKey = tuple[str, str, str]  #: data set, task or embedding, and name of the job


def asked_for(specs: Mapping[str, DatasetSpec], tasks: Sequence[TaskKey]) -> list[Asked]:
    """Return every experiment that tasks and embeddings ask for, in the order of the report."""
    return [one for dataset, task in tasks for one in asked_of(specs[dataset], task)]


def of_paper(
    specs: Mapping[str, DatasetSpec], asked: Mapping[JobKey, Asked]
) -> dict[JobKey, Asked]:
    """Return the experiments that reproduce the paper: cross-validation and the named experiments
    of tasks with published values, and embeddings of data sets with such tasks."""
    return {key: one for key, one in asked.items() if _is_of_paper(specs[one.dataset], one)}


def _is_of_paper(spec: DatasetSpec, asked: Asked) -> bool:
    name = asked.experiment.name
    if asked.experiment.of_embedding:
        return any(task.papers for task in spec.tasks.values())
    papers = spec.tasks[asked.task].papers
    return name in papers or (bool(papers) and name == CROSS_VALIDATION)


def computed(paths: Paths, asked: Sequence[Asked]) -> list[Asked]:
    """Return the experiments whose results exist, each with the models that were measured."""
    found = []
    for one in asked:
        models = [
            model
            for model, key in zip(one.models, one.keys, strict=True)
            if paths.experiment(*key).is_file() and paths.experiment_cost(*key).is_file()
        ]
        if models:
            found.append(replace(one, models=tuple(models)))
    return found


def page_of(asked: Asked, spec: DatasetSpec) -> str:
    """Return the name of the page that an experiment on a task stands on: that which the task
    names, or that of its data set, unless the experiment has its own."""
    one = asked.experiment
    if one.own_page or one.of_embedding:
        return one.name
    return spec.tasks[asked.task].page or asked.dataset


def run_experiment(
    store: Path,
    *,
    kind: str,
    dataset: str,
    task: str,
    settings: Mapping[str, Any],
    split: Mapping[str, Any],
    others: Sequence[str],
    audio: AudioSettings,
    features: FeatureSettings,
    paths: Paths,
    seed: int,
    tables: Path,
    cost: Path,
    encoders: Sequence[Path] = (),
    rendered: str = "",
) -> None:
    """Measure the experiment `kind` (name, or name and model) on a task and write its tables.

    `split` are the settings of the task (`DatasetSpec.task_settings`), `encoders` the latents and
    training cost of an embedding. If `rendered` is not empty, sounds are simulated by the recipe of
    the data set. A task that lacks what the experiment needs is written as skipped, with reason.
    """
    name, _, model = kind.partition("-")
    experiment, table = EXPERIMENTS[name], read_store(store)
    about = {"experiment": name, "dataset": dataset, "task": task, "model": model, "seed": seed}
    about |= {**split, "settings": settings, "provenance": dict(table.attrs), **device_facts()}
    compared = {other: _comparable(store, table, paths.features(other)) for other in others}
    read_too = compared if experiment.reads_recordings else {}
    inputs = Inputs(
        dataset=dataset, task=task, **split, seed=seed, store=table, others=compared, audio=audio,
        features=features, **_encoded(*encoders),
        **_sounds(paths, dataset, audio, read_too, rendered),
    )  # fmt: skip
    results, costs = _measure(experiment, inputs, settings, about)
    if "skipped" in about:
        tell(f"skipped   {dataset}/{task}, {kind}: {about['skipped']}")
    write_tables(cost, costs)
    write_tables(tables, results, **about)


def _measure(
    experiment: Experiment, inputs: Inputs, settings: Mapping[str, Any], about: dict[str, Any]
) -> tuple[Sequence[Table], Sequence[Table]]:
    """Return tables of results and of cost; add facts, or why there are none, to `about`."""
    try:
        about["left_out"] = dict(inputs.classes_of_task[1])
        checked = experiment.settings.model_validate(settings)
        outcome = experiment.measure(inputs, checked, about["model"])
    except NotPossibleError as error:
        about["skipped"] = str(error)
        return (), ()
    about |= outcome.about
    return outcome.tables, outcome.cost


def _comparable(store: Path, table: FeatureRows, path: Path) -> FeatureRows:
    """Return another store, whose spectra have the axes of `table`. Raises DataError otherwise."""
    other = read_store(path)
    for name, here, there in differing_axes(_settings(table), _settings(other)):
        problem = f"its {name} is {there}, that of {store} is {here}: they do not compare"
        raise DataError(path, problem, "give both data sets the same, and run again")
    if table.frequency_hz.tolist() != other.frequency_hz.tolist():
        problem = f"its frequencies are not those of {store}: they do not compare"
        raise DataError(path, problem, "delete both, and run again")
    return other


def _sounds(
    paths: Paths,
    dataset: str,
    audio: AudioSettings,
    others: Mapping[str, FeatureRows],
    rendered: str,
) -> dict[str, Any]:
    """Return what reads recordings, and what simulates sounds, by name of the input."""
    # SciPy and the simulation, which Snakemake does not need
    from ajgdata.pipeline.recipes import renderer
    from ajgdata.pipeline.recordings import RecordingReader

    read = {n: AudioSettings.model_validate(_settings(one)["audio"]) for n, one in others.items()}
    return {
        "recordings": RecordingReader(paths, {dataset: audio, **read}),
        "render": renderer(paths, dataset) if rendered else None,
    }


def _settings(table: FeatureRows) -> dict[str, Any]:
    """Return the settings by which the features of a store were computed."""
    return json.loads(str(table.attrs.get("settings", "{}")))


def _encoded(latents: Path | None = None, training_cost: Path | None = None) -> dict[str, Any]:
    """Return what an embedding's encoders made and cost, by name."""
    from ajgdata.store.features import read_latents

    if latents is None or training_cost is None:
        return {}
    return {"latents": read_latents(latents), "training_cost": read_json(training_cost)}


def read_results(
    paths: Paths, asked: Asked, specs: Mapping[str, DatasetSpec], paper: Mapping[str, PaperFigure]
) -> tuple[TaskResults, list[tuple[str, str]]]:
    """Return the results of an experiment on a task, and the label of each model that was skipped,
    with the reason."""
    spec, results, skipped = specs[asked.dataset], [], []
    split, source = spec.task_settings(asked.task), "recorded"
    for model, kind in zip(asked.models, asked.kinds, strict=True):
        about, tables = read_tables(paths.experiment(asked.dataset, asked.task, kind))
        _, costs = read_tables(paths.experiment_cost(asked.dataset, asked.task, kind))
        label = asked.label(model or about["model"], split["kind"])
        source = about["provenance"]["source"]
        if "skipped" in about:
            skipped.append((label, about["skipped"]))
        else:
            named, cost = ({t.name: t for t in some} for some in (tables, costs))
            results.append(Result(model or about["model"], label, about, named, cost))
    return TaskResults(
        experiment=asked.experiment.name,
        dataset=spec.name,
        dataset_title=spec.title or spec.name,
        task=asked.task,
        kind=split["kind"],
        target=split["target"],
        unit=split["unit"],
        groups=split["groups"],
        source="simulated" if source == "simulated" else "recorded",
        page=page_of(asked, spec),
        settings=asked.settings,
        results=tuple(results),
        papers={part: paper[name] for part, name in _papers(asked, specs, paper).items()},
        others={n: Other(specs[n].title or n, specs[n].level) for n in asked.others if n in specs},
        level=spec.level,
        period_deg=split.get("period_deg"),
        left_out=results[0].about.get("left_out", {}) if results else {},
    ), skipped


def _papers(
    asked: Asked, specs: Mapping[str, DatasetSpec], paper: Mapping[str, PaperFigure]
) -> Mapping[str, str]:
    """Return the published values that results are compared with, by part.

    An embedding is compared if a task of its data set is.
    """
    one, spec = asked.experiment, specs[asked.dataset]
    if not one.of_embedding:
        return spec.tasks[asked.task].papers
    named = [task.papers for task in spec.tasks.values()]
    return {one.name: one.paper} if one.paper in paper and any(named) else {}
