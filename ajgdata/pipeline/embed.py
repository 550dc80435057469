"""Feature file -> latents of every recording, by networks that each held some recordings out."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ajgdata.evaluate.embedding_data import (
    EmbeddingData,
    embedding_data,
    fold_of,
    train_on,
    validation_folds,
)
from ajgdata.models.device import device_facts
from ajgdata.store.features import Latents, read_store, write_latents
from ajgdata.store.files import json_bytes, write_bytes
from ajgdata.types import Embedding, NotPossibleError

if TYPE_CHECKING:
    from ajgdata.evaluate.splits import Folds


def train_embedding(
    store: Path, *, settings: Embedding, seed: int, latents: Path, cost: Path
) -> None:
    """Train an encoder for each dimension, fold and initialisation, and write the latents of every
    recording by each; apart from that (`cost`) what the training took.

    If training is impossible, for instance because objects were grasped once, the reason is written
    instead.
    """
    table = read_store(store)
    text = json.dumps(settings.model_dump(mode="json"), sort_keys=True)
    attrs: dict[str, str | float | int] = {**table.attrs, "embedding": text, "seed": seed}
    attrs |= device_facts()
    spent: dict[str, Any] = {}
    try:
        data = embedding_data(table, settings)
        folds = validation_folds(data, settings, seed)
        wall, cpu = time.perf_counter(), time.process_time()
        latent, encoding = _latents(data, folds, settings, seed)
    except NotPossibleError as error:
        skipped = {**attrs, "skipped": str(error)}
        write_latents(latents, Latents({}, np.zeros(0, np.int32), {}, skipped))
    else:
        spent = {
            "networks": len(folds) * len(settings.dimensions) * settings.inits,
            "wall_s": time.perf_counter() - wall,
            "cpu_s": time.process_time() - cpu - sum(encoding),
            "encode_s_per_recording": float(np.median(encoding)) / len(data.feature),
        }
        write_latents(latents, Latents(latent, fold_of(folds), data.columns, attrs))
    write_bytes(cost, json_bytes(spent))


def _latents(
    data: EmbeddingData, folds: Folds, settings: Embedding, seed: int
) -> tuple[dict[int, np.ndarray], list[float]]:
    """Return latents (fold, init, n, d) of all recordings by dimension, and the CPU time in s that
    each network took to encode them."""
    shape, encoding = (len(folds), settings.inits, len(data.feature)), []
    latent = {d: np.empty((*shape, d), np.float32) for d in settings.dimensions}
    for fold, (train, _) in enumerate(folds):
        for init in range(settings.inits):
            encoders = train_on(data, train, settings, settings.dimensions, (seed, fold, init))
            for dimension, encoder in zip(settings.dimensions, encoders, strict=True):
                began = time.process_time()
                latent[dimension][fold, init] = encoder.encode(data.feature)
                encoding.append(time.process_time() - began)
    return latent, encoding
