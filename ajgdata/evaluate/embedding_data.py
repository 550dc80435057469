"""Recordings of an embedding as arrays, their folds, and the training of the encoders."""

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
    """Recordings of objects, with their labels from the acquisition log.

    `feature` (n, f). `instance`, `grasp` and `group` (n,) are the names of objects, grasps and
    groups of folds. `columns` are all columns of the feature file, each with n values.
    `available`: number of recordings before thinning; 0 if not thinned.
    """

    feature: np.ndarray
    instance: np.ndarray
    grasp: np.ndarray
    group: np.ndarray
    columns: Mapping[str, FeatureColumn]
    available: int = 0

    @property
    def thinned(self) -> dict[str, int]:
        """Return the numbers of recordings after and before thinning; empty if not thinned."""
        if not self.available:
            return {}
        return {"recordings": len(self.feature), "available": self.available}

    def column(self, name: str) -> np.ndarray:
        """Return one column (n,). Raises NotPossibleError if it is missing."""
        if name not in self.columns:
            raise NotPossibleError(f"there is no column {name!r}: add it to recordings.csv")
        return self.columns[name].values

    @property
    def holds_out_objects(self) -> bool:
        """Return whether folds by `group` hold out complete objects: each has one group."""
        pairs = set(zip(self.group.tolist(), self.instance.tolist(), strict=True))
        return len(pairs) == len(np.unique(self.instance))


def embedding_data(table: FeatureRows, settings: Embedding) -> EmbeddingData:
    """Return the recordings of `table` with names of object, grasp and group.

    Recordings of the empty gripper have no object, so they are excluded. If there are more than
    `settings.most_recordings`, a subset is used, with equal numbers of all grasps as far as
    possible. Raises NotPossibleError for a missing column, and for fewer than two objects.
    """
    names = (settings.instance, "grasp_id", settings.groups)
    for name in names:
        if name not in table.columns:
            raise NotPossibleError(f"there is no column {name!r}: add it to recordings.csv")
    labels = [table.columns[name].values.astype(str) for name in names]
    is_named = np.all([~np.isin(column, ["", "nan"]) for column in labels], axis=0)
    if not is_named.any():
        raise NotPossibleError(f"no recording has {', '.join(dict.fromkeys(names))}")
    rows = np.flatnonzero(is_named)
    limit = settings.most_recordings
    available = 0
    if len(rows) > limit:
        available = len(rows)
        instance, grasp, _ = (column[rows] for column in labels)
        rows = rows[thinned(grasp, limit, instance)]
    instance, grasp, group = (column[rows] for column in labels)
    if len(np.unique(instance)) < 2:
        raise NotPossibleError(
            f"all recordings are of one object, {str(instance[0])!r}: two are needed"
        )
    columns = {
        name: FeatureColumn(column.values[rows], column.attrs)
        for name, column in table.columns.items()
    }
    return EmbeddingData(table.flat[rows], instance, grasp, group, columns, available)


def train_on(
    data: EmbeddingData,
    train: np.ndarray,
    settings: Embedding,
    dimensions: Sequence[int],
    seeds: Sequence[int],
) -> list[Encoder]:
    """Return encoders of `dimensions`, trained on the rows `train`, with one seed from `seeds`."""
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
    """Return the folds by group.

    They hold out complete objects if each object has one group. Otherwise each training part has
    all objects.
    """
    kind: Kind = "regression" if data.holds_out_objects else "classification"
    folds = min(settings.folds, len(np.unique(data.group)))
    return grouped_folds(data.instance, data.group, kind, folds, seed)


def fold_numbers(folds: Folds) -> np.ndarray:
    """Return the number (n,) of the fold that tests each row."""
    number = np.empty(sum(len(test) for _, test in folds), np.int32)
    for fold, (_, test) in enumerate(folds):
        number[test] = fold
    return number


class EmbeddingRun(NamedTuple):
    """Points (n, d) of all rows, and the row numbers of the training part and of the test part.

    The points are embeddings by one encoder, or raw features with the scaling of one fold.
    """

    points: np.ndarray
    train: np.ndarray
    test: np.ndarray


def embedding_runs(latent: np.ndarray, fold: np.ndarray) -> Iterator[EmbeddingRun]:
    """Yield the runs of embeddings (folds, initialisations, n, d).

    `fold` (n,) is the number of the fold that tests each row.
    """
    for number, initialisations in enumerate(latent):
        for points in initialisations:
            train = np.flatnonzero(fold != number)
            test = np.flatnonzero(fold == number)
            yield EmbeddingRun(points, train, test)


def runs_by_space(
    data: EmbeddingData, latent: np.ndarray, fold: np.ndarray
) -> Iterator[tuple[str, list[EmbeddingRun]]]:
    """Yield "latent" with the runs of embeddings, then "raw" with one run of features per fold.

    See `embedding_runs` for `latent` and `fold`.
    """
    yield "latent", list(embedding_runs(latent, fold))
    runs = []
    for number in range(len(latent)):
        train = np.flatnonzero(fold != number)
        test = np.flatnonzero(fold == number)
        scaling = raw_scaling().fit(data.feature[train])
        runs.append(EmbeddingRun(scaling.transform(data.feature), train, test))
    yield "raw", runs
