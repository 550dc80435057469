"""Distances and k-NN in an embedding, in the raw features and in what PCA and UMAP make of them.

Everything is learned from the training rows and applied to the others.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.spatial.distance import cdist
from sklearn.metrics import silhouette_score
from sklearn.neighbors import KNeighborsClassifier
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import FunctionTransformer
from threadpoolctl import threadpool_limits

from ajgdata.embed.projections import REDUCERS, ReducerName, is_reducible, make_reducer
from ajgdata.evaluate.embedding_data import EmbeddingData, runs_of
from ajgdata.models.baselines import NEIGHBOURS
from ajgdata.models.scaling import raw_scaling
from ajgdata.store.features import Latents


def mean_distances(
    space: np.ndarray, label: np.ndarray, names: np.ndarray, apart: np.ndarray
) -> np.ndarray:
    """Return the mean Euclidean distance (c, c) between the recordings of each two of `names`.

    `space` (n, d), `label` (n,); only pairs that differ in `apart` (n,) count, such as the grasp.
    NaN without neighbours. The diagonal holds the distances within a label.
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


def score(
    points: np.ndarray,
    value: np.ndarray,
    train: np.ndarray,
    test: np.ndarray,
    space: Pipeline | None = None,
) -> Scored:
    """Return the scores of k-NN on points (n, d), in a `space` that is fitted to the training rows.

    `value` (n,) is what is predicted; `train` and `test` are row numbers. Latents need no space,
    because the training of their encoder is measured elsewhere.
    """
    known, new, fit_s, transform_s = points[train], points[test], 0.0, 0.0
    with threadpool_limits(limits=1):
        if space is not None:
            known, fit_s = _timed(partial(space.fit_transform, known))
            new, transform_s = _timed(partial(space.transform, new))
        model = KNeighborsClassifier(min(NEIGHBOURS, len(known))).fit(known, value[train])
        predicted, query_s = _timed(partial(model.predict, new))
    return Scored(float(np.mean(predicted == value[test])), fit_s, transform_s, query_s)


def reduced_space(reducer: ReducerName, dimension: int, seed: int) -> Pipeline:
    """Return the scaling of raw features, followed by a reducer of float32 points."""
    single = FunctionTransformer(np.float32)
    return make_pipeline(raw_scaling(), single, make_reducer(reducer, dimension, seed))


def warm_up(reducer: ReducerName) -> None:
    """Have a reducer compile what it compiles at its first use."""
    points = np.random.default_rng(0).normal(size=(WARM_UP, 8)).astype(np.float32)
    make_reducer(reducer, 2, 0).fit(points).transform(points[:5])


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
    yield "raw", None, [score(data.feature, value, *parts, raw_scaling()) for parts in folds]
    for dimension in dimensions:
        runs = runs_of(latents.latent[dimension], fold)
        scores = [score(z, value, known(train), known(test)) for z, train, test in runs]
        yield "latent", dimension, scores
    fewest = min(len(train) for train, _ in folds)
    for reducer in REDUCERS:
        warm_up(reducer)
        for dimension in dimensions:
            if is_reducible(dimension, fewest):
                space = partial(reduced_space, reducer, dimension, seed)
                yield (
                    reducer,
                    dimension,
                    [score(data.feature, value, *parts, space()) for parts in folds],
                )
