"""Distances of pairs as UMAP takes them: those of scikit-learn's loop, but for the order in which
squares are summed, which is the compiler's choice."""

import sys

import numpy as np
import pytest
from sklearn.metrics import pairwise_distances

from ajgdata.embed.compiled import umap

UMAP = umap()  # which imports these without its warning
distances, umap_ = sys.modules["umap.distances"], sys.modules["umap.umap_"]
pair_distances = sys.modules["ajgdata.embed.pair_distances"].pair_distances


def points(rows, d, dtype=np.float32, seed=0):
    return np.random.default_rng(seed).normal(size=(rows, d)).astype(dtype)


@pytest.mark.parametrize("d", [1, 7, 64, 1025])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_are_those_of_scikit_learn(d, dtype):
    x, y = points(30, d, dtype), points(11, d, dtype, seed=1)
    for given in ((x,), (y, x)):
        found = pair_distances(*given, metric=distances.euclidean)
        expected = pairwise_distances(*given, metric=distances.euclidean)
        assert found.dtype == expected.dtype == dtype
        np.testing.assert_allclose(found, expected, rtol=d * np.finfo(dtype).eps)  # of any order
    assert pair_distances(x[:2], metric=distances.euclidean)[0, 1] == pytest.approx(
        np.linalg.norm(x[0].astype(float) - x[1]), rel=1e-5
    )


def test_other_metrics_are_left_to_scikit_learn():
    x = points(5, 3)
    found = pair_distances(x, metric="cityblock")
    np.testing.assert_allclose(found, np.abs(x[:, None] - x).sum(axis=2), rtol=1e-5, atol=1e-6)


def test_umap_places_points_where_it_did_without(monkeypatch):
    x, new = points(60, 20), points(9, 20, seed=1)
    asked = []

    def with_metric(*given, metric, **named):
        asked.append(metric)
        return pair_distances(*given, metric=metric, **named)

    placed = []
    for take in (pairwise_distances, with_metric):
        monkeypatch.setattr(umap_, "pairwise_distances", take)
        model = UMAP(n_components=2, n_jobs=1, random_state=3, transform_seed=3)
        placed.append([model.fit_transform(x), model.transform(new)])
    near = [take(x, metric=distances.euclidean) for take in (pairwise_distances, pair_distances)]
    if np.array_equal(*near):  # UMAP makes much of a last digit
        for plain, compiled in zip(*placed, strict=True):
            np.testing.assert_array_equal(plain, compiled)
    assert asked == [distances.euclidean] * 2
