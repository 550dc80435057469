"""Experiments of a run: which are asked for, their measurement as a job, and their results.

Called while Snakemake parses, too: light imports only.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ajgdata.experiments import (
    EXPERIMENTS,
    JobKey,
    MeasurementKey,
    Request,
    measurement_name,
    requested_experiments,
)
from ajgdata.experiments.base import Experiment, Inputs, Other, Outcome, Result, TaskResults
from ajgdata.features.spectrum import differing_axes
from ajgdata.models.device import device_facts
from ajgdata.paths import Paths
from ajgdata.pipeline.progress import tell
from ajgdata.store.features import read_store
from ajgdata.store.files import read_json
from ajgdata.store.tables import read_measurements, write_measurements
from ajgdata.types import (
    CROSS_VALIDATION,
    AudioSettings,
    DataError,
    DatasetSpec,
    FeatureSettings,
    NotPossibleError,
    Strict,
    TaskSettings,
)

if TYPE_CHECKING:
    from ajgdata.report.comparison import PaperFigure
    from ajgdata.store.features import FeatureRows
    from ajgdata.types.table import Table

TaskKey = tuple[str, str]  #: data set, and task or embedding


class Measurement(NamedTuple):
    """What an experiment measured of a task, with one model: facts, tables, and tables of cost."""

    about: dict[str, Any]
    tables: list[Table]
    cost: list[Table]


def requests_for(specs: Mapping[str, DatasetSpec], tasks: Sequence[TaskKey]) -> list[Request]:
    """Return every experiment that tasks and embeddings ask for, in the order of the report."""
    return [r for dataset, task in tasks for r in requested_experiments(specs[dataset], task)]


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


def run_experiment(
    store: Path,
    *,
    dataset: str,
    task: str,
    experiment: str,
    parts: Sequence[str],
    settings: Mapping[str, Any],
    task_settings: TaskSettings,
    other_sets: Sequence[str],
    audio: AudioSettings,
    features: FeatureSettings,
    paths: Paths,
    seed: int,
    tables: Path,
    cost: Path,
    encoders: Sequence[Path] = (),
    rendered: str = "",
    other_tasks: Mapping[str, TaskSettings] | None = None,
) -> None:
    """Measure each of the parts of an experiment on a task (see `MeasuredPart`); write the tables.

    `encoders` are the latents and training cost of an embedding. If `rendered` is not empty, sounds
    and grasps are simulated by the recipe of the data set. `other_tasks` are those of the data set
    that the settings name. A task that lacks what the experiment needs is
    written as skipped, with the reason.
    """
    measured = EXPERIMENTS[experiment]
    table = read_store(store)
    about = {
        "experiment": experiment,
        "dataset": dataset,
        "task": task,
        "seed": seed,
        **task_settings.model_dump(mode="json", exclude_unset=True),
        "settings": settings,
        "provenance": dict(table.attrs),
        **device_facts(),
    }
    compared = {other: _comparable(store, table, paths.features(other)) for other in other_sets}
    read_too = compared if measured.reads_recordings else {}
    inputs = Inputs(
        dataset=dataset,
        task=task,
        task_settings=task_settings,
        seed=seed,
        store=table,
        other_sets=compared,
        audio=audio,
        features=features,
        other_tasks=other_tasks or {},
        **_encoded(*encoders),
        **_sounds(paths, dataset, audio, read_too, rendered),
    )
    checked = measured.settings.model_validate(settings)
    refused = _copied_sets(inputs, getattr(checked, "test_on", ()))
    outcomes = [
        _measure(measured, inputs, checked, about | {"model": part}, refused) for part in parts
    ]
    write_measurements(cost, [({}, outcome.cost) for outcome in outcomes])
    write_measurements(tables, [(outcome.about, outcome.tables) for outcome in outcomes])


def _measure(
    experiment: Experiment,
    inputs: Inputs,
    settings: Strict,
    about: Mapping[str, Any],
    refused: Mapping[str, str],
) -> Outcome:
    """Return tables of results and of cost, and `about` with more facts, or why there are none.

    `refused` are data sets with copies of training recordings, with the reason. A cross-validation
    is measured without these test sets; other experiments require all their data sets.
    """
    name = measurement_name(experiment.name, about["model"])
    try:
        if refused and experiment.name != CROSS_VALIDATION:
            raise NotPossibleError("; ".join(refused.values()))
        settings = _without_test_sets(settings, refused)
        about = {**about, "left_out": dict(inputs.classes_of_task[1])}
        outcome = experiment.measure(inputs, settings, about["model"])
    except NotPossibleError as error:
        tell(f"skipped   {about['dataset']}/{about['task']}, {name}: {error}")
        return Outcome((), (), {**about, "skipped": str(error)})
    if refused:
        parts = {f"the test on {dataset}": reason for dataset, reason in refused.items()}
        about = {**about, "others": parts}
        for part, reason in parts.items():
            tell(f"skipped   {about['dataset']}/{about['task']}, {part} of {name}: {reason}")
    return replace(outcome, about={**about, **outcome.about})


def _without_test_sets(settings: Strict, refused: Collection[str]) -> Strict:
    """Return settings without the refused data sets of `test_on`."""
    if not refused:
        return settings
    used = tuple(name for name in getattr(settings, "test_on", ()) if name not in refused)
    return settings.model_copy(update={"test_on": used})


def _copied_sets(inputs: Inputs, test_on: Sequence[str]) -> dict[str, str]:
    """Return why data sets of `test_on` contain copies of training recordings, by name."""
    # the simulation, which Snakemake does not need
    from ajgdata.pipeline.similar_sounds import leak_refusals, sounds_of

    if not test_on:
        return {}
    quantity = inputs.features.quantity
    tests = {name: sounds_of(inputs.other_sets[name], [], quantity) for name in test_on}
    return leak_refusals(sounds_of(inputs.store, [], quantity), tests)


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
    paths: Paths, dataset: str, audio: AudioSettings, read: Mapping[str, FeatureRows], rendered: str
) -> dict[str, Any]:
    """Return what reads recordings, and what simulates sounds and grasps, by name of the input."""
    # SciPy and the simulation, which Snakemake does not need
    from ajgdata.pipeline.recipes import grasp_simulator, renderer
    from ajgdata.pipeline.recordings import RecordingReader

    settings = {n: AudioSettings.model_validate(_settings(t)["audio"]) for n, t in read.items()}
    return {
        "recordings": RecordingReader(paths, {dataset: audio, **settings}),
        "render": renderer(paths, dataset) if rendered else None,
        "grasps": grasp_simulator(paths, dataset) if rendered else None,
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
    from ajgdata.evaluate.mirror import mirror_plane
    from ajgdata.gripper import Scene

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
