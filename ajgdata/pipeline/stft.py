"""Recordings -> errors of cheap models, and the feature's run time, for settings of the STFT."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.evaluate.task_data import TaskData, split_withheld, task_data
from ajgdata.features.spectrum import spectrum
from ajgdata.pipeline.recordings import examine
from ajgdata.store.features import read_store
from ajgdata.store.files import json_bytes, write_bytes
from ajgdata.store.manifest import read_manifest
from ajgdata.store.tables import plain
from ajgdata.types import AudioSettings, FeatureSettings, Kind

#: Recordings held at once, and transformed with one setting after the other: the times of all
#: settings are then of the same moments.
BLOCK = 64


def stft_task(
    store: Path,
    *,
    root: Path,
    manifests: Sequence[Path],
    audio: AudioSettings,
    settings: Sequence[FeatureSettings],
    models: Sequence[str],
    target: str,
    kind: Kind,
    unit: str,
    groups: str,
    folds: int,
    period_deg: float | None,
    withhold: Sequence[float],
    seed: int,
    output: Path,
    cost: Path,
) -> None:
    """Cross-validate `models` on the recordings of a task, features made by each of `settings`.

    The recordings are those of `store`, which has their labels; `manifests` say where they are
    below `root`. Each is read once. The same folds serve all settings. Errors go to `output`, times
    to `cost`: processor time of one thread, the median over recordings.
    """
    shard = read_store(store)
    about = {"target": target, "kind": kind, "unit": unit, "groups": groups, "folds": folds}
    about |= {"model": ""}  # several
    document: dict[str, Any] = {**about, "seed": seed, "provenance": dict(shard.attrs)}
    measured: list[dict[str, Any]] = []
    try:
        if any(one.align for one in settings):
            raise ValueError("settings of the STFT need recordings as they are: no features.align")
        rows = split_withheld(task_data(shard, target, kind, groups), withhold)[0]
        made = features_of(rows, root, manifests, audio, settings)
        document["points"] = []
        for one, (features, seconds) in zip(settings, made, strict=True):
            errors, times = _evaluated(
                rows._replace(feature=features), kind, models, folds, seed, period_deg
            )
            about_it = one.model_dump(mode="json", include={"window", "hop", "band_hz"})
            about_it["bins"] = features.shape[1]
            document["points"].append({**about_it, "models": errors})
            measured.append({"feature_s_per_recording": seconds, "models": times})
    except ValueError as error:
        document["skipped"] = str(error)
        measured = []
    write_bytes(cost, json_bytes(plain(measured)))
    write_bytes(output, json_bytes(plain(document)))


def features_of(
    rows: TaskData,
    root: Path,
    manifests: Sequence[Path],
    audio: AudioSettings,
    settings: Sequence[FeatureSettings],
) -> list[tuple[np.ndarray, float]]:
    """Features (n, bins) of `rows` for each of `settings`, and the median time of one in seconds.

    Raises ValueError for a recording that is gone or was changed into one that cannot be used.
    """
    where: dict[str, str] = {}
    for path in manifests:
        content = read_manifest(path)[0]
        session = content["session_id"]
        where |= {f"{session}/{e['recording_id']}": e["path"] for e in content["recordings"]}
    features: list[list[np.ndarray]] = [[] for _ in settings]
    seconds: list[list[float]] = [[] for _ in settings]
    longest = max(one.window for one in settings)
    for start in range(0, len(rows.name), BLOCK):
        block = []
        for name in rows.name[start : start + BLOCK].tolist():
            samples = examine(root / where[name], audio, longest).samples
            if samples is None:
                problem = f"recording {name!r} cannot be used with a window of {longest}"
                raise ValueError(f"{problem}: see its data set's quarantine, or lower the window")
            block.append(samples)
        for one, found, times in zip(settings, features, seconds, strict=True):
            for samples in block:
                begun = time.process_time()
                found.append(spectrum(samples, audio.sample_rate_hz, one))
                times.append(time.process_time() - begun)
    return [
        (np.array(found), float(np.median(times)))
        for found, times in zip(features, seconds, strict=True)
    ]


def _evaluated(
    rows: TaskData, kind: Kind, models: Sequence[str], folds: int, seed: int, period: float | None
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Errors and cost by model."""
    from ajgdata.evaluate.crossval import cross_validate

    errors, times = {}, {}
    for model in models:
        found = cross_validate(
            rows.feature, rows.value, rows.group,
            kind=kind, model=model, folds=folds, seed=seed, period=period,
        )  # fmt: skip
        kept = ("per_fold", "mean", "sd", "pooled", "chance")
        scores = dataclasses.asdict(found.scores)
        errors[model] = {name: scores[name] for name in kept}
        times[model] = {
            "train_s": found.cost.train_s,
            "inference_s_per_recording": found.cost.inference_s_per_recording,
        }
    return errors, times
