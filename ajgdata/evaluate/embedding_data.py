"""Recordings of an embedding as arrays, its folds, and the training of its encoders."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ajgdata.evaluate.splits import Folds, grouped_folds
from ajgdata.models.scaling import raw_scaling
from ajgdata.models.thinning import thinned
from ajgdata.store.features import FeatureColumn, FeatureRows
from ajgdata.types import Embedding, Kind, NotPossibleError

if TYPE_CHECKING:
    from ajgdata.embed.encoder import Encoder


@dataclass(frozen=True, eq=False)
class EmbeddingData:
    """Recordings of things, and all that the acquisition log says of them.

    `feature` (n, f); `instance`, `grasp` and `group` (n,) are labels as text; `columns` all that
    the store holds, of length n. `available` is how many there were, where these are some of them,
    else 0.
    """

    feature: np.ndarray
    instance: np.ndarray
    grasp: np.ndarray
    group: np.ndarray
    columns: Mapping[str, FeatureColumn]
    available: int = 0

    @property
    def thinned(self) -> dict[str, int]:
        """Return of how many recordings these are some, as `available`; nothing if of all."""
        if not self.available:
            return {}
        return {"recordings": len(self.feature), "available": self.available}

    def column(self, name: str) -> np.ndarray:
        """Return one column (n,). Raises ValueError if it is missing."""
        if name not in self.columns:
            raise NotPossibleError(f"there is no column {name!r}: add it to recordings.csv")
        return self.columns[name].values

    @property
    def separated(self) -> bool:
        """Return whether folds by `group` always part things: validation is of unseen ones."""
        pairs = {*zip(self.group.tolist(), self.instance.tolist(), strict=True)}
        return len(pairs) == len(np.unique(self.instance))


class EmbeddingRun(NamedTuple):
    """One network, or one fold of the raw features: points (n, d), rows trained on, rows tested."""

    points: np.ndarray
    train: np.ndarray
    test: np.ndarray


def embedding_data(table: FeatureRows, settings: Embedding) -> EmbeddingData:
    """Return the recordings of which the log says what they are of; an empty gripper is no thing.

    Of more than `most_recordings` as many of every grasp as can be. Raises
    ValueError for a column that is missing, and where fewer than two things are left.
    """
    names = (settings.instance, "grasp_id", settings.groups)
    for name in names:
        if name not in table.columns:
            raise NotPossibleError(f"there is no column {name!r}: add it to recordings.csv")
    text = [table.columns[name].values.astype(str) for name in names]
    known = np.all([~np.isin(column, ["", "nan"]) for column in text], axis=0)
    if not known.any():
        raise NotPossibleError(f"no recording has {', '.join(dict.fromkeys(names))}")
    rows = np.flatnonzero(known)
    count, limit = len(rows), settings.most_recordings
    if count > limit:
        rows = rows[thinned(text[1][rows], limit, text[0][rows])]
    columns = {n: FeatureColumn(c.values[rows], c.attrs) for n, c in table.columns.items()}
    instance, grasp, group = (column[rows] for column in text)
    if len(np.unique(instance)) < 2:
        raise NotPossibleError(
            f"all recordings are of one object, {str(instance[0])!r}: two are needed"
        )
    available = count if count > limit else 0
    return EmbeddingData(table.feature[rows], instance, grasp, group, columns, available)


def train_on(
    data: EmbeddingData,
    train: np.ndarray,
    settings: Embedding,
    dimensions: Sequence[int],
    seeds: Sequence[int],
) -> list[Encoder]:
    """Return encoders of `dimensions`, trained on the rows `train`."""
    from ajgdata.embed.encoder import train_encoders

    return train_encoders(
        data.feature[train],
        data.instance[train],
        data.grasp[train],
        dimensions=dimensions,
        settings=settings,
        seed=int(np.random.SeedSequence(seeds).generate_state(1)[0]),
    )


def validation_folds(data: EmbeddingData, settings: Embedding, seed: int) -> Folds:
    """Return folds by group; every thing in all of them, unless its recordings are one group."""
    kind: Kind = "regression" if data.separated else "classification"
    folds = min(settings.folds, len(np.unique(data.group)))
    return grouped_folds(data.instance, data.group, kind, folds, seed)


def fold_of(folds: Folds) -> np.ndarray:
    """Return the number (n,) of the fold that tests each row."""
    number = np.empty(sum(len(test) for _, test in folds), np.int32)
    for fold, (_, test) in enumerate(folds):
        number[test] = fold
    return number


def runs_of(latent: np.ndarray, fold: np.ndarray) -> Iterator[EmbeddingRun]:
    """Yield the runs of latents (fold, init, n, d), of which `fold` (n,) says which tests a row."""
    for number, of_fold in enumerate(latent):
        for points in of_fold:
            yield EmbeddingRun(
                points, np.flatnonzero(fold != number), np.flatnonzero(fold == number)
            )


def runs_by_space(
    data: EmbeddingData, latent: np.ndarray, fold: np.ndarray
) -> Iterator[tuple[str, list[EmbeddingRun]]]:
    """Yield the runs of the latent, then of the raw features, which have one for each fold."""
    yield "latent", list(runs_of(latent, fold))
    runs = []
    for number in range(len(latent)):
        train, test = np.flatnonzero(fold != number), np.flatnonzero(fold == number)
        scaling = raw_scaling().fit(data.feature[train])
        runs.append(EmbeddingRun(scaling.transform(data.feature), train, test))
    yield "raw", runs
