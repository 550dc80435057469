"""Feature store -> latents of every recording, by networks that each left some recordings out."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ajgdata.store.features import Column, Shard, read_store, settings_text
from ajgdata.store.files import json_bytes, write_bytes
from ajgdata.store.latents import Latents, write_latents
from ajgdata.store.tables import plain
from ajgdata.types import Embedding, Kind

if TYPE_CHECKING:
    from sklearn.pipeline import Pipeline

    from ajgdata.embed.encoder import Encoder
    from ajgdata.evaluate.splits import Folds


@dataclass(frozen=True, eq=False)
class Logged:
    """Recordings of things and what the acquisition log says of them.

    `feature` (n, f); `instance`, `grasp` and `group` (n,) are labels as text; `columns` all that
    the store holds, of length n.
    """

    feature: np.ndarray
    instance: np.ndarray
    grasp: np.ndarray
    group: np.ndarray
    columns: Mapping[str, Column]

    def column(self, name: str) -> np.ndarray:
        """One column (n,); ValueError if there is none."""
        if name not in self.columns:
            raise ValueError(f"there is no column {name!r}: add it to recordings.csv")
        return self.columns[name].values

    @property
    def separated(self) -> bool:
        """Whether folds by `group` always part things, so that validation is of unseen ones."""
        pairs = {*zip(self.group.tolist(), self.instance.tolist(), strict=True)}
        return len(pairs) == len(np.unique(self.instance))


def logged_of(shard: Shard, settings: Embedding) -> Logged:
    """The recordings of which the log says what they are of; an empty gripper is no thing."""
    names = (settings.instance, "grasp_id", settings.groups)
    for name in names:
        if name not in shard.columns:
            raise ValueError(f"there is no column {name!r}: add it to recordings.csv")
    text = [shard.columns[name].values.astype(str) for name in names]
    known = np.all([~np.isin(column, ["", "nan"]) for column in text], axis=0)
    if not known.any():
        raise ValueError(f"no recording has {', '.join(names)}")
    columns = {n: Column(c.values[known], c.attrs) for n, c in shard.columns.items()}
    instance, grasp, group = (column[known] for column in text)
    if len(np.unique(instance)) < 2:
        raise ValueError(f"all recordings are of one thing, {instance[0]!r}: two are needed")
    return Logged(shard.feature[known], instance, grasp, group, columns)


def train_embedding(
    store: Path, *, settings: Embedding, seed: int, latents: Path, cost: Path
) -> None:
    """Train an encoder for each dimension, fold and initialisation, and write what each says of
    every recording; apart from that (`cost`) what the training took.

    What cannot be trained, for instance things that were grasped once, is written as such with the
    reason.
    """
    shard = read_store(store)
    told = settings_text(settings.model_dump(mode="json"))
    attrs: Mapping[str, str | float | int] = {**shard.attrs, "embedding": told, "seed": seed}
    spent: dict[str, Any] = {}
    try:
        found = _trained(logged_of(shard, settings), settings, seed, attrs, spent)
    except ValueError as error:
        nothing = np.zeros(0, np.int32)
        found = Latents({}, nothing, None, nothing, {}, {**attrs, "skipped": str(error)})
    write_latents(latents, found)
    write_bytes(cost, json_bytes(spent))


def _trained(
    logged: Logged,
    settings: Embedding,
    seed: int,
    attrs: Mapping[str, str | float | int],
    spent: dict[str, Any],
) -> Latents:
    wall, cpu = time.perf_counter(), time.process_time()
    folds, unseen_folds = validation_folds(logged, settings, seed), _unseen_folds(logged, settings)
    encoding: list[float] = []
    latent = _encoded(logged, folds, settings, settings.dimensions, seed, encoding)
    unseen, unseen_fold = None, np.full(len(logged.feature), -1)
    if logged.separated:
        unseen, unseen_fold = latent[settings.shown], fold_of(folds)
    elif unseen_folds:
        only = _encoded(logged, unseen_folds, settings, (settings.shown,), seed, encoding)
        unseen, unseen_fold = only[settings.shown], fold_of(unseen_folds)
    trained = 0 if logged.separated else len(unseen_folds)
    spent |= {
        "networks": (len(folds) * len(settings.dimensions) + trained) * settings.inits,
        "wall_s": time.perf_counter() - wall,
        "cpu_s": time.process_time() - cpu - sum(encoding),
        "encode_s_per_recording": float(np.median(encoding)) / len(logged.feature),
    }
    return Latents(latent, fold_of(folds), unseen, unseen_fold, logged.columns, attrs)


def _encoded(
    logged: Logged,
    folds: Folds,
    settings: Embedding,
    dimensions: Sequence[int],
    seed: int,
    encoding: list[float],
) -> dict[int, np.ndarray]:
    """Latents (fold, init, n, d) of all recordings, by dimension. The processor time in s that each
    network took to encode them is added to `encoding`."""
    shape = (len(folds), settings.inits, len(logged.feature))
    latent = {d: np.empty((*shape, d), np.float32) for d in dimensions}
    for fold, (train, _) in enumerate(folds):
        for init in range(settings.inits):
            encoders = train_on(logged, train, settings, dimensions, (seed, fold, init))
            for dimension, encoder in zip(dimensions, encoders, strict=True):
                began = time.process_time()
                latent[dimension][fold, init] = encoder.encode(logged.feature)
                encoding.append(time.process_time() - began)
    return latent


def train_on(
    logged: Logged,
    train: np.ndarray,
    settings: Embedding,
    dimensions: Sequence[int],
    seeds: Sequence[int],
    scaling: Pipeline | None = None,
) -> list[Encoder]:
    """Encoders of `dimensions`, trained on the rows `train`."""
    from ajgdata.embed.encoder import Training, train_encoders

    training = Training(
        margin=settings.margin,
        epochs=settings.epochs,
        batch_instances=settings.batch_instances,
        batch_recordings=settings.batch_recordings,
    )
    return train_encoders(
        logged.feature[train],
        logged.instance[train],
        logged.grasp[train],
        dimensions=dimensions,
        training=training,
        seed=int(np.random.SeedSequence(seeds).generate_state(1)[0]),
        scaling=scaling,
    )


def validation_folds(logged: Logged, settings: Embedding, seed: int) -> Folds:
    """Folds by group; every thing in all of them, unless its recordings are one group."""
    from ajgdata.evaluate.splits import grouped_folds

    kind: Kind = "regression" if logged.separated else "classification"
    folds = min(settings.folds, len(np.unique(logged.group)))
    return grouped_folds(logged.instance, logged.group, kind, folds, seed)


def _unseen_folds(logged: Logged, settings: Embedding) -> Folds:
    """Folds that each leave some things out; none if none are asked for."""
    from ajgdata.evaluate.splits import grouped_folds

    if not settings.retrieval_folds:
        return []
    folds = min(settings.retrieval_folds, len(np.unique(logged.instance)))
    return grouped_folds(logged.instance, logged.instance, "regression", folds, seed=0)


def fold_of(folds: Folds) -> np.ndarray:
    """The fold (n,) that tests each row."""
    number = np.empty(sum(len(test) for _, test in folds), np.int32)
    for fold, (_, test) in enumerate(folds):
        number[test] = fold
    return number


def runs_of(
    latent: np.ndarray, fold: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Of each fold and initialisation: latents (n, d), rows trained on, rows left out."""
    for number, of_fold in enumerate(latent):
        for one in of_fold:
            yield one, np.flatnonzero(fold != number), np.flatnonzero(fold == number)


def summary(values: Sequence[float]) -> dict[str, Any]:
    """Mean, sample standard deviation and values of all runs."""
    from ajgdata.evaluate.crossval import deviation

    return {"mean": np.mean(values), "sd": deviation(values), "per_run": list(values)}


def write_document(path: Path, settings: Embedding, attrs: Mapping[str, Any], made: Any) -> None:
    """One document on an embedding, with its settings and what it was made from."""
    kept = {name: value for name, value in attrs.items() if name not in ("embedding", "skipped")}
    about = {"settings": settings.model_dump(mode="json"), "provenance": kept}
    write_bytes(path, json_bytes(plain({**about, **made})))
