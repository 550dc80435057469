"""Train the final models of tasks on all recordings, and the encoders of embeddings."""

from __future__ import annotations

import dataclasses
import json
import time
from collections.abc import Sequence
from pathlib import Path
from shutil import copytree
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from ajgdata.evaluate.embedding_data import (
    EmbeddingData,
    embedding_data,
    fold_numbers,
    train_on,
    validation_folds,
)
from ajgdata.evaluate.in_use import calibration
from ajgdata.evaluate.novelty import NoveltyGuard
from ajgdata.evaluate.splits import Folds, balanced_rows
from ajgdata.evaluate.task_data import (
    TaskData,
    TrainingCopies,
    column_labels,
    grasp_names,
    input_layout,
    target_values,
    training_data,
    training_part,
)
from ajgdata.models import fit_named_model, search_result
from ajgdata.models.device import device_facts
from ajgdata.paths import Paths
from ajgdata.pipeline.copies import RecordingCopies, copy_maker
from ajgdata.store.features import FeatureRows, Latents, read_store, write_latents
from ajgdata.store.files import json_bytes, read_json, write_bytes
from ajgdata.store.models import ABOUT_FILE, write_about, write_estimator, write_guard
from ajgdata.store.tables import plain
from ajgdata.types import (
    MODELS,
    AnyFeature,
    AudioSettings,
    Embedding,
    NotPossibleError,
    TrainingSettings,
)
from ajgdata.types.input_layout import Covariate


def train_final_model(
    store: Path,
    equal: Sequence[Path],
    *,
    dataset: str,
    settings: TrainingSettings,
    task: str,
    model: str,
    seed: int,
    audio: AudioSettings,
    features: AnyFeature,
    paths: Paths,
    folder: Path,
) -> None:
    """Train a model of a task on the feature file `store`, and write it into `folder`.

    `audio` and `features` are settings of the data set. `equal` has the folder of the same model of
    a task with equal settings, which is copied; without such a task it is empty.
    """
    if equal:
        copytree(equal[0], folder, dirs_exist_ok=True)
        write_about(folder, {**read_json(folder / ABOUT_FILE), "task": task})
        return
    table = read_store(store)
    maker = copy_maker(
        settings.augment, table, paths, {dataset: audio}, features, dataset=dataset, seed=seed
    )
    train_model(
        table,
        settings,
        task=task,
        model=model,
        seed=seed,
        folder=folder,
        dataset=dataset,
        maker=maker,
    )


def train_model(
    table: FeatureRows,
    settings: TrainingSettings,
    *,
    model: str,
    seed: int,
    folder: Path,
    task: str = "",
    dataset: str = "",
    maker: RecordingCopies | None = None,
) -> None:
    """Train `model` on all recordings of `table` that have the target, and write it into `folder`.

    With a `maker`, it is also trained on their copies; `dataset` is the data set of `table`.

    This includes its calibration and the arrays that a predictor needs. If the model cannot be
    trained, only its description is written, with the reason. If it cannot be calibrated, the
    description contains the reason.
    """
    description: dict[str, Any] = {
        "target": settings.target,
        "kind": settings.kind,
        "unit": settings.unit,
        "model": model,
        "period": settings.period_deg,
        "seed": seed,
        "task": task,
        "provenance": dict(table.attrs),
        **device_facts(),
    }
    if settings.axes:
        description["axes"] = list(settings.axes)
    try:
        data = training_data(table, settings)
        if settings.balance:
            description["balance"] = True
            data = data.where(balanced_rows(data.value, data.group))
        copies = None if maker is None else maker.copies(dataset, data.name.tolist())
        facts = _train(table, data, copies, settings, model=model, seed=seed, folder=folder)
        description.update(facts)
    except NotPossibleError as error:
        description["skipped"] = str(error)
    write_about(folder, plain(description))


def _train(
    table: FeatureRows,
    data: TaskData,
    copies: TrainingCopies | None,
    settings: TrainingSettings,
    *,
    model: str,
    seed: int,
    folder: Path,
) -> dict[str, Any]:
    """Train and calibrate a model, and write it and the arrays of its guard into `folder`.

    The model is also trained on the `copies`. Calibration and guard use only the recordings.
    Returns facts for the description of the model. Raises NotPossibleError if it cannot be trained.
    """
    kind = settings.kind
    arrays = (data.feature, data.value, data.group)
    layout = input_layout(table, settings)
    options: dict[str, Any] = {"seed": seed, "period": settings.period_deg, "layout": layout}
    grasp = grasp_names(table, data)
    objects = column_labels(table, data, "object")
    trained = training_part(data, np.arange(len(data.name)), copies)
    training_arrays = (trained.feature, trained.value, trained.group)
    with threadpool_limits(limits=1):
        fitted = fit_named_model(model, kind, *training_arrays, **options)
        estimator, choice = search_result(fitted)
        calibrated = calibration(
            *arrays, grasp, model=model, kind=kind, objects=objects, copies=copies, **options
        )
    facts = {
        **table.settings,  # audio and features
        "recordings": len(data.name),
        **table.coordinates,
        "classes": np.unique(data.value).tolist() if kind == "classification" else [],
        "calibration": calibrated.plain(),
    }
    if choice:
        facts["tuning"] = choice
    if settings.covariates:
        trained_covariates = _covariates(table, data, settings.covariates)
        facts["covariates"] = [dataclasses.asdict(covariate) for covariate in trained_covariates]
    if settings.augment is not None:
        facts["augment"] = settings.augment.model_dump(mode="json", exclude_unset=True)
        facts["copies"] = len(trained.name) - len(data.name)
    used = min(MODELS[model].most_recordings, len(trained.name))
    if used < len(trained.name):
        facts["trained_on"] = used
    write_guard(folder, _guard_arrays(table, settings, data, grasp, objects))
    write_estimator(folder, estimator)
    return facts


def _covariates(table: FeatureRows, data: TaskData, names: Sequence[str]) -> list[Covariate]:
    """Return the covariates, which are the last columns of the features of `data`."""
    values = data.feature[:, -len(names) :]
    return [
        Covariate(
            name,
            table.columns[name].attrs.get("units", ""),
            float(values[:, at].min()),
            float(values[:, at].max()),
        )
        for at, name in enumerate(names)
    ]


def _guard_arrays(
    table: FeatureRows,
    settings: TrainingSettings,
    data: TaskData,
    grasp: np.ndarray,
    objects: np.ndarray,
) -> dict[str, np.ndarray]:
    """Return the arrays of the guard against novel objects, by name.

    Its references are the recordings that have neither an object nor a value of the target. If the
    empty gripper is a class, there are therefore no references.
    """
    values = target_values(table, settings.target, settings.axes)
    if settings.kind == "regression":
        missing = ~np.isfinite(values).reshape(len(values), -1).any(axis=1)
    else:
        missing = values == ""
    empty = missing & (table.columns["object"].values == "")
    sounds = input_layout(table, settings).feature(data.feature)
    guard = NoveltyGuard.from_grasps(sounds, grasp, objects).with_references(table.flat[empty])
    names = [field.name for field in dataclasses.fields(guard)]
    return {name: getattr(guard, name) for name in names if not name.endswith("threshold")}


def train_embedding(
    store: Path, *, settings: Embedding, seed: int, latents: Path, cost: Path
) -> None:
    """Train an encoder for each dimension, fold and initialisation of an embedding.

    The `latents` of every recording by each encoder are written, and the `cost` of the training in
    another file, because it differs between runs. If training is impossible, for example because
    each object was grasped once, the reason is written instead.
    """
    table = read_store(store)
    text = json.dumps(settings.model_dump(mode="json"), sort_keys=True)
    attrs: dict[str, str | float | int] = {
        **table.attrs,
        "embedding": text,
        "seed": seed,
        **device_facts(),
    }
    try:
        data = embedding_data(table, settings)
        folds = validation_folds(data, settings, seed)
        start_s = time.perf_counter()
        start_cpu_s = time.process_time()
        latent, encoding_s = _latents(data, folds, settings, seed)
    except NotPossibleError as error:
        skipped = {**attrs, "skipped": str(error)}
        write_latents(latents, Latents({}, np.zeros(0, np.int32), {}, skipped))
        write_bytes(cost, json_bytes({}))
        return
    spent = {
        "networks": len(folds) * len(settings.dimensions) * settings.inits,
        "wall_s": time.perf_counter() - start_s,
        "cpu_s": time.process_time() - start_cpu_s - sum(encoding_s),
        "encode_s_per_recording": float(np.median(encoding_s)) / len(data.feature),
    }
    write_latents(latents, Latents(latent, fold_numbers(folds), data.columns, attrs))
    write_bytes(cost, json_bytes(spent))


def _latents(
    data: EmbeddingData, folds: Folds, settings: Embedding, seed: int
) -> tuple[dict[int, np.ndarray], list[float]]:
    """Return latents (fold, init, n, d) of all recordings by dimension, and encoding times.

    These are the CPU times in s that each network took to encode the n recordings.
    """
    shape = (len(folds), settings.inits, len(data.feature))
    latent = {d: np.empty((*shape, d), np.float32) for d in settings.dimensions}
    encoding_s = []
    for fold, (train, _) in enumerate(folds):
        for init in range(settings.inits):
            encoders = train_on(data, train, settings, settings.dimensions, (seed, fold, init))
            for dimension, encoder in zip(settings.dimensions, encoders, strict=True):
                start_s = time.process_time()
                latent[dimension][fold, init] = encoder.encode(data.feature)
                encoding_s.append(time.process_time() - start_s)
    return latent, encoding_s
