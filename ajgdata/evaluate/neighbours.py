"""Distances and k-NN in an embedding, in the raw features and in what PCA and UMAP make of them.

Everything is learned from the training rows and applied to the others.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.distance import cdist
from sklearn.metrics import silhouette_score
from sklearn.neighbors import KNeighborsClassifier
from threadpoolctl import threadpool_limits

from ajgdata.embed.projections import REDUCERS, ReducerName, make_reducer, reducible
from ajgdata.evaluate.embedding_data import EmbeddingData, runs_of
from ajgdata.models.baselines import NEIGHBOURS
from ajgdata.models.scaling import raw_scaling

if TYPE_CHECKING:
    from ajgdata.store.latents import Latents


def mean_distances(
    space: np.ndarray, label: np.ndarray, names: np.ndarray, apart: np.ndarray
) -> np.ndarray:
    """Return the mean Euclidean distance (c, c) between the recordings of each two of `names`.

    `space` (n, d), `label` (n,); only pairs that differ in `apart` (n,) count, such as the grasp.
    NaN where there is none. The diagonal holds the distances within a label.
    """
    member = (label[:, None] == names[None]).astype(float)  # (n, c)
    counts = (apart[:, None] != apart[None]).astype(float)
    number = member.T @ counts @ member
    total = member.T @ (cdist(space, space) * counts) @ member
    return np.where(number > 0, total / np.where(number > 0, number, 1), np.nan)


def silhouette(space: np.ndarray, label: np.ndarray) -> float:
    """Return the mean silhouette (Rousseeuw 1987) of points (n, d) with labels (n,), NaN unless
    there are 2 to n - 1 labels."""
    if not 2 <= len(np.unique(label)) < len(label):
        return float("nan")
    return float(silhouette_score(space, label))


#: Rows of the untimed call that lets UMAP compile.
WARM_UP = 40


@dataclass(frozen=True)
class Scored:
    """Validation accuracy, and processor time in s: of scaling and reducing the training rows, of
    applying that to the validation rows, and of finding their neighbours."""

    accuracy: float
    fit_s: float
    transform_s: float
    query_s: float


def score_latent(
    latent: np.ndarray, value: np.ndarray, train: np.ndarray, test: np.ndarray
) -> Scored:
    """Return the scores of k-NN on latents (n, d); what training took is known elsewhere.

    `value` (n,) is what is predicted; `train` and `test` are row numbers.
    """
    accuracy, query_s = _neighbours(latent[train], latent[test], value[train], value[test])
    return Scored(accuracy, 0.0, 0.0, query_s)


def score_raw(
    features: np.ndarray, value: np.ndarray, train: np.ndarray, test: np.ndarray
) -> Scored:
    """Return the scores of the baseline: k-NN on features (n, f), compressed and standardised."""
    scaling = raw_scaling()
    known, fit_s = _timed(lambda: scaling.fit_transform(features[train]))
    asked, transform_s = _timed(lambda: scaling.transform(features[test]))
    accuracy, query_s = _neighbours(known, asked, value[train], value[test])
    return Scored(accuracy, fit_s, transform_s, query_s)


def score_reduced(
    features: np.ndarray,
    value: np.ndarray,
    train: np.ndarray,
    test: np.ndarray,
    *,
    reducer: ReducerName,
    dimension: int,
    seed: int,
) -> Scored | None:
    """Return the scores of k-NN after reducing the scaled features (n, f); None if the training
    rows are too few for that. `value` (n,); `train`, `test` are row numbers."""
    if not reducible(dimension, len(train)):
        return None
    scaling, method = raw_scaling(), make_reducer(reducer, dimension, seed)
    known, asked = features[train], features[test]
    with threadpool_limits(limits=1):
        known, fit_s = _timed(
            lambda: method.fit_transform(scaling.fit_transform(known).astype(np.float32))
        )
        asked, transform_s = _timed(
            lambda: method.transform(scaling.transform(asked).astype(np.float32))
        )
    accuracy, query_s = _neighbours(known, asked, value[train], value[test])
    return Scored(accuracy, fit_s, transform_s, query_s)


def warm_up(reducer: ReducerName) -> None:
    """Have a reducer compile what it compiles at its first use."""
    points = np.random.default_rng(0).normal(size=(WARM_UP, 8)).astype(np.float32)
    made = make_reducer(reducer, 2, 0)
    made.fit_transform(points)
    made.transform(points[:5])


def _neighbours(
    known: np.ndarray, asked: np.ndarray, value: np.ndarray, true: np.ndarray
) -> tuple[float, float]:
    model = KNeighborsClassifier(min(NEIGHBOURS, len(known))).fit(known, value)
    with threadpool_limits(limits=1):
        read, query_s = _timed(lambda: model.predict(asked))
    return float(np.mean(read == true)), query_s


def _timed(call: Callable[[], np.ndarray]) -> tuple[np.ndarray, float]:
    start = time.process_time()
    result = call()
    return result, time.process_time() - start


def scores_by_space(
    data: EmbeddingData, latents: Latents, value: np.ndarray, dimensions: Sequence[int], seed: int
) -> Iterator[tuple[str, int | None, list[Scored]]]:
    """Yield space, dimension and the score of each run: raw features, latents, then reducers.

    `value` (n,) is text; rows without it ("") are neither learned from nor tested. Reducers that
    cannot reach a dimension are left out.
    """
    present, fold = value != "", latents.validation_fold

    def known(rows: np.ndarray) -> np.ndarray:
        return rows[present[rows]]

    folds = [
        (known(np.flatnonzero(fold != k)), known(np.flatnonzero(fold == k)))
        for k in range(fold.max() + 1)
    ]
    yield "raw", None, [score_raw(data.feature, value, *parts) for parts in folds]
    for dimension in dimensions:
        runs = runs_of(latents.latent[dimension], fold)
        yield (
            "latent",
            dimension,
            [score_latent(z, value, known(train), known(test)) for z, train, test in runs],
        )
    for reducer in REDUCERS:
        warm_up(reducer)
        for dimension in dimensions:
            reduced = [
                score_reduced(
                    data.feature, value, *parts, reducer=reducer, dimension=dimension, seed=seed
                )
                for parts in folds
            ]
            scored = [one for one in reduced if one is not None]
            if len(scored) == len(folds):
                yield reducer, dimension, scored
