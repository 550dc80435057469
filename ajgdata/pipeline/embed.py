"""Feature store -> latents of every recording, by networks that each left some recordings out."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping, Sequence
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
from ajgdata.store.features import read_store
from ajgdata.store.files import json_bytes, write_bytes
from ajgdata.store.latents import Latents, write_latents
from ajgdata.types import Embedding, NotPossibleError

if TYPE_CHECKING:
    from ajgdata.evaluate.splits import Folds


def train_embedding(
    store: Path, *, settings: Embedding, seed: int, latents: Path, cost: Path
) -> None:
    """Train an encoder for each dimension, fold and initialisation, and write the latents of every
    recording by each; apart from that (`cost`) what the training took.

    What cannot be trained, for instance things that were grasped once, is written as such with the
    reason.
    """
    shard = read_store(store)
    text = json.dumps(settings.model_dump(mode="json"), sort_keys=True)
    attrs: Mapping[str, str | float | int] = {**shard.attrs, "embedding": text, "seed": seed}
    spent: dict[str, Any] = {}
    try:
        found = _trained(embedding_data(shard, settings), settings, seed, attrs, spent)
    except NotPossibleError as error:
        found = Latents({}, np.zeros(0, np.int32), {}, {**attrs, "skipped": str(error)})
    write_latents(latents, found)
    write_bytes(cost, json_bytes(spent))


def _trained(
    data: EmbeddingData,
    settings: Embedding,
    seed: int,
    attrs: Mapping[str, str | float | int],
    spent: dict[str, Any],
) -> Latents:
    wall, cpu = time.perf_counter(), time.process_time()
    folds = validation_folds(data, settings, seed)
    encoding: list[float] = []
    latent = _encoded(data, folds, settings, settings.dimensions, seed, encoding)
    spent |= {
        "networks": len(folds) * len(settings.dimensions) * settings.inits,
        "wall_s": time.perf_counter() - wall,
        "cpu_s": time.process_time() - cpu - sum(encoding),
        "encode_s_per_recording": float(np.median(encoding)) / len(data.feature),
    }
    return Latents(latent, fold_of(folds), data.columns, attrs)


def _encoded(
    data: EmbeddingData,
    folds: Folds,
    settings: Embedding,
    dimensions: Sequence[int],
    seed: int,
    encoding: list[float],
) -> dict[int, np.ndarray]:
    """Return latents (fold, init, n, d) of all recordings, by dimension. The processor time in s
    that each network took to encode them is added to `encoding`."""
    shape = (len(folds), settings.inits, len(data.feature))
    latent = {d: np.empty((*shape, d), np.float32) for d in dimensions}
    for fold, (train, _) in enumerate(folds):
        for init in range(settings.inits):
            encoders = train_on(data, train, settings, dimensions, (seed, fold, init))
            for dimension, encoder in zip(dimensions, encoders, strict=True):
                began = time.process_time()
                latent[dimension][fold, init] = encoder.encode(data.feature)
                encoding.append(time.process_time() - began)
    return latent
