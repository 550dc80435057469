"""Distances and silhouettes of points whose answers are known."""

from itertools import islice

import numpy as np
import pytest

from ajgdata.evaluate.embedding_data import EmbeddingData
from ajgdata.evaluate.neighbours import mean_distances, scores_by_space, silhouette
from ajgdata.store.features import Latents


def test_mean_distances_by_hand():
    space = np.array([[0.0], [3.0], [4.0], [10.0]])
    label = np.array(["x", "x", "x", "y"])
    names = np.array(["x", "y"])
    grasp = np.array([1, 2, 2, 3])
    distances = mean_distances(space, label, names, grasp)
    assert distances[0, 0] == (3 + 4) / 2  # not between the second and third: one grasp
    assert distances[0, 1] == distances[1, 0] == pytest.approx((10 + 7 + 6) / 3)
    assert np.isnan(distances[1, 1])  # there is one of y


def test_silhouette_of_far_clusters_is_nearly_1():
    space = np.concatenate([np.zeros((5, 2)), np.full((5, 2), 9.0)])
    assert silhouette(space, np.repeat([0, 1], 5)) == 1.0
    assert np.isnan(silhouette(space, np.zeros(10)))
    assert np.isnan(silhouette(space, np.arange(10)))


# k-NN in the folds of an embedding

#: Two clusters of ten points each, in turn, that are apart in eight of nine bins.
CLUSTER = np.tile([0, 1], 10)
POINTS = np.column_stack([*[100.0 * CLUSTER] * 8, np.arange(20.0)]).astype(np.float32)


def accuracies(value: np.ndarray, fold: np.ndarray) -> dict[str, list[float]]:
    """Accuracy of each fold in the raw features and in latents that are the same points."""
    names = np.arange(20).astype(str)
    data = EmbeddingData(POINTS, names, names, names, {})
    folds = fold.max() + 1
    latents = Latents({9: np.tile(POINTS, (folds, 1, 1, 1))}, fold, {}, {})
    spaces = islice(scores_by_space(data, latents, value, [9], seed=0), 2)  # without PCA and UMAP
    return {space: [score.accuracy for score in scores] for space, _, scores in spaces}


def test_a_class_that_only_the_tested_rows_have_is_never_predicted():
    """Each fold has a class of its own, so k-NN is right only if it was trained on tested rows."""
    computed = accuracies(np.array(["a", "b"])[CLUSTER], fold=CLUSTER)
    assert computed == {"raw": [0.0, 0.0], "latent": [0.0, 0.0]}


def test_each_fold_is_predicted_from_all_others_and_rows_without_a_label_are_left_out():
    """Folds 0 and 2 hold one class each: no other class could be predicted from them alone."""
    value = np.array(["a", "b"])[CLUSTER]
    fold = np.where(CLUSTER == 0, np.arange(20) % 4 // 2, np.arange(20) // 2 % 2 + 1)
    value[[0, 5, 12]] = ""
    computed = accuracies(value, fold)
    assert computed == {"raw": [1.0, 1.0, 1.0], "latent": [1.0, 1.0, 1.0]}
