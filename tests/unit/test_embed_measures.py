"""Distances and silhouettes of points whose answers are known."""

import numpy as np
import pytest

from ajgdata.evaluate.neighbours import mean_distances, silhouette


def test_mean_distances_by_hand():
    space = np.array([[0.0], [3.0], [4.0], [10.0]])
    label, names = np.array(["x", "x", "x", "y"]), np.array(["x", "y"])
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
