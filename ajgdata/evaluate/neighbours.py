"""Distances and k-NN in an embedding, in the raw features, and after PCA and UMAP.

Scalings, reducers and k-NN are fitted to the training rows, and tested on the other rows.
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
from ajgdata.evaluate.embedding_data import EmbeddingData, embedding_runs
from ajgdata.models.baselines import NEIGHBOURS
from ajgdata.models.scaling import raw_scaling
from ajgdata.store.features import Latents

#: Number of rows of the untimed call in which UMAP compiles its functions.
WARM_UP_ROWS = 40


def mean_distances(
    points: np.ndarray, label: np.ndarray, names: np.ndarray, grasp: np.ndarray
) -> np.ndarray:
    """Return the mean Euclidean distance (c, c) between recordings of each pair of labels.

    `points` (n, d), `label` (n,) and `grasp` (n,); `names` (c,) are the labels of rows and columns.
    Pairs of recordings of one grasp are excluded. A distance is NaN if there are no pairs. The
    diagonal has the distances within a label.
    """
    member = (label[:, None] == names[None]).astype(float)  # (n, c)
    is_counted = (grasp[:, None] != grasp[None]).astype(float)  # (n, n)
    pairs = member.T @ is_counted @ member
    total = member.T @ (cdist(points, points) * is_counted) @ member
    return np.where(pairs > 0, total / np.where(pairs > 0, pairs, 1), np.nan)


def silhouette(points: np.ndarray, label: np.ndarray) -> float:
    """Return the mean silhouette (Rousseeuw 1987) of points (n, d) with labels (n,).

    It is NaN unless there are 2 to n - 1 labels.
    """
    if not 2 <= len(np.unique(label)) < len(label):
        return float("nan")
    return float(silhouette_score(points, label))


@dataclass(frozen=True)
class NeighbourScore:
    """Accuracy of k-NN on the test rows, and CPU times in s.

    `fit_s` is the time to fit scaling and reducer to the training rows, `transform_s` the time to
    apply both to the test rows, and `query_s` the time to predict the test rows.
    """

    accuracy: float
    fit_s: float
    transform_s: float
    query_s: float


def scores_by_space(
    data: EmbeddingData, latents: Latents, value: np.ndarray, dimensions: Sequence[int], seed: int
) -> Iterator[tuple[str, int | None, list[NeighbourScore]]]:
    """Yield space, dimension and one score per run: raw features, embeddings, then reducers.

    `value` (n,) are the labels to predict, as text; rows with "" are neither trained on nor tested.
    A reducer is omitted for a dimension that it cannot reach. There is one run per fold, for
    embeddings one per fold and initialisation.
    """
    has_value = value != ""
    fold = latents.validation_fold

    def labelled(rows: np.ndarray) -> np.ndarray:
        return rows[has_value[rows]]

    folds = []
    for number in range(fold.max() + 1):
        train = labelled(np.flatnonzero(fold != number))
        test = labelled(np.flatnonzero(fold == number))
        folds.append((train, test))
    yield "raw", None, [_score(data.feature, value, *part, raw_scaling()) for part in folds]
    for dimension in dimensions:
        runs = embedding_runs(latents.latent[dimension], fold)
        scores = [_score(z, value, labelled(train), labelled(test)) for z, train, test in runs]
        yield "latent", dimension, scores
    fewest = min(len(train) for train, _ in folds)
    for reducer in REDUCERS:
        _warm_up(reducer)
        for dimension in dimensions:
            if is_reducible(dimension, fewest):
                scores = [
                    _score(data.feature, value, *part, _reduced_space(reducer, dimension, seed))
                    for part in folds
                ]
                yield reducer, dimension, scores


def _score(
    points: np.ndarray,
    value: np.ndarray,
    train: np.ndarray,
    test: np.ndarray,
    space: Pipeline | None = None,
) -> NeighbourScore:
    """Return the score of k-NN on points (n, d), after a `space` that is fitted to training rows.

    `value` (n,) are labels; `train` and `test` are row numbers. Embeddings have no `space`: the
    cost of their encoder is measured during its training.
    """
    known = points[train]
    new = points[test]
    fit_s = 0.0
    transform_s = 0.0
    with threadpool_limits(limits=1):
        if space is not None:
            known, fit_s = _timed(partial(space.fit_transform, known))
            new, transform_s = _timed(partial(space.transform, new))
        model = KNeighborsClassifier(min(NEIGHBOURS, len(known))).fit(known, value[train])
        predicted, query_s = _timed(partial(model.predict, new))
    accuracy = float(np.mean(predicted == value[test]))
    return NeighbourScore(accuracy, fit_s, transform_s, query_s)


def _timed(call: Callable[[], np.ndarray]) -> tuple[np.ndarray, float]:
    """Return the result of a call, and its CPU time in s."""
    start = time.process_time()
    result = call()
    return result, time.process_time() - start


def _warm_up(reducer: ReducerName) -> None:
    """Use a reducer once, because some libraries compile functions at the first use."""
    points = np.random.default_rng(0).normal(size=(WARM_UP_ROWS, 8)).astype(np.float32)
    make_reducer(reducer, 2, 0).fit(points).transform(points[:5])


def _reduced_space(reducer: ReducerName, dimension: int, seed: int) -> Pipeline:
    """Return the scaling of raw features, followed by a reducer of float32 points."""
    as_float32 = FunctionTransformer(np.float32)
    return make_pipeline(raw_scaling(), as_float32, make_reducer(reducer, dimension, seed))
