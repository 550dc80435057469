"""The job of an experiment: measure it on a task and write its tables."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ajgdata.experiments.base import Experiment, Inputs, Outcome
from ajgdata.experiments.registry import load_experiment
from ajgdata.experiments.requests import measurement_name
from ajgdata.features.spectrum import differing_axes
from ajgdata.models.device import device_facts
from ajgdata.paths import Paths
from ajgdata.pipeline.copies import copy_maker
from ajgdata.pipeline.progress import tell
from ajgdata.pipeline.recipes import grasp_simulator, renderer
from ajgdata.pipeline.recordings import RecordingReader
from ajgdata.pipeline.similar_sounds import leak_refusals, sounds_of
from ajgdata.store.feature_array import same_axes
from ajgdata.store.features import FeatureRows, read_latents, read_store
from ajgdata.store.files import read_json
from ajgdata.store.tables import write_measurements
from ajgdata.types import (
    CROSS_VALIDATION,
    AnyFeature,
    AudioSettings,
    DataError,
    NotPossibleError,
    Strict,
    TaskSettings,
)


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
    features: AnyFeature,
    paths: Paths,
    seed: int,
    tables: Path,
    cost: Path,
    encoders: Sequence[Path] = (),
    rendered: str = "",
    other_tasks: Mapping[str, TaskSettings] | None = None,
) -> None:
    """Measure each of the parts of an experiment on a task (see `MeasuredPart`); write the tables.

    `store` is the feature file of the data set. `encoders` are the latents and the training cost of
    an embedding, or empty. If `rendered` is not empty, the experiment can simulate sounds and
    grasps by the recipe of the data set. `other_tasks` are those of the data set that the settings
    name. If the task lacks what the experiment needs, it is written as skipped, with the reason.
    """
    measured = load_experiment(experiment)
    checked = measured.spec.settings.model_validate(settings)
    table = read_store(store)
    compared = {other: _comparable(store, table, paths.features(other)) for other in other_sets}
    read_audio = {dataset: audio}
    if measured.spec.reads_recordings or task_settings.augment:
        for name, other in compared.items():
            read_audio[name] = AudioSettings.model_validate(_settings(other)["audio"])
    inputs = Inputs(
        dataset=dataset,
        task=task,
        task_settings=task_settings,
        seed=seed,
        store=table,
        other_sets=compared,
        audio=audio,
        features=features,
        recordings=RecordingReader(paths, read_audio),
        render=renderer(paths, dataset) if rendered else None,
        grasps=grasp_simulator(paths, dataset) if rendered else None,
        copy_maker=copy_maker(
            task_settings.augment, table, paths, read_audio, features, dataset=dataset, seed=seed
        ),
        other_tasks=other_tasks or {},
        latents=read_latents(encoders[0]) if encoders else None,
        training_cost=read_json(encoders[1]) if encoders else {},
        folder=paths.dataset(dataset).parent,
    )
    refused = _copied_sets(inputs, getattr(checked, "test_on", ()))
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
    outcomes = [
        _measure(measured, inputs, checked, {**about, "model": part}, refused) for part in parts
    ]
    write_measurements(cost, [({}, outcome.cost) for outcome in outcomes])
    write_measurements(tables, [(outcome.about, outcome.tables) for outcome in outcomes])


def _comparable(store: Path, table: FeatureRows, path: Path) -> FeatureRows:
    """Return the feature file at `path`, whose spectra must have the axes of `table`, from `store`.

    Raises DataError if a setting or a frequency differs.
    """
    other = read_store(path)
    for name, here, there in differing_axes(_settings(table), _settings(other)):
        problem = f"its {name} is {there}, that of {store} is {here}: they do not compare"
        raise DataError(path, problem, "give both data sets the same, and run again")
    if not same_axes(table.axes, other.axes):
        problem = f"the dimensions of its features are not those of {store}: they do not compare"
        raise DataError(path, problem, "delete both, and run again")
    return other


def _settings(table: FeatureRows) -> dict[str, Any]:
    """Return the settings of audio and features with which a feature file was computed."""
    return json.loads(str(table.attrs.get("settings", "{}")))


def _copied_sets(inputs: Inputs, test_on: Sequence[str]) -> dict[str, str]:
    """Return the data sets of `test_on` with copies of training recordings, with the reason."""
    if not test_on:
        return {}
    features = inputs.features
    tests = {name: sounds_of(inputs.other_sets[name], [], features) for name in test_on}
    return leak_refusals(sounds_of(inputs.store, [], features), tests)


def _measure(
    experiment: Experiment,
    inputs: Inputs,
    settings: Strict,
    about: Mapping[str, Any],
    refused: Mapping[str, str],
) -> Outcome:
    """Return the tables of results and of cost, and `about` with more facts.

    If the part cannot be measured, there are no tables, and `about` contains the reason. `refused`
    are data sets with copies of training recordings, with the reason. A cross-validation is
    measured without these test sets; other experiments require all their data sets.
    """
    name = measurement_name(experiment.spec.name, about["model"])
    task = f"{about['dataset']}/{about['task']}"
    facts = dict(about)
    try:
        if refused:
            if experiment.spec.name != CROSS_VALIDATION:
                raise NotPossibleError("; ".join(refused.values()))
            settings = _without_test_sets(settings, refused)
        facts["left_out"] = dict(inputs.classes_of_task[1])
        outcome = experiment.measure(inputs, settings, about["model"])
    except NotPossibleError as error:
        tell(f"skipped   {task}, {name}: {error}")
        return Outcome((), (), {**facts, "skipped": str(error)})
    if refused:
        parts = {f"the test on {dataset}": reason for dataset, reason in refused.items()}
        facts["others"] = parts
        for part, reason in parts.items():
            tell(f"skipped   {task}, {part} of {name}: {reason}")
    return replace(outcome, about={**facts, **outcome.about})


def _without_test_sets(settings: Strict, refused: Collection[str]) -> Strict:
    """Return settings without the refused data sets of `test_on`."""
    used = tuple(name for name in getattr(settings, "test_on", ()) if name not in refused)
    return settings.model_copy(update={"test_on": used})
