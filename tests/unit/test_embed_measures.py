"""Retrieval, distances and silhouettes of points whose answers are known."""

import numpy as np
import pytest

from ajgdata.evaluate.distances import mean_distances, precision_at, silhouette


def test_precision_by_hand():
    space = np.array([[0.0], [0.1], [1.0], [1.5], [1.2], [9.0]])
    thing = np.array(["a", "a", "a", "a", "b", "b"])
    grasp = np.array(["a1", "a1", "a2", "a3", "b1", "b2"])
    found = precision_at(
        space, thing, grasp, queries=np.array([0]), gallery=np.arange(6), at=(1, 2)
    )
    # without its own grasp: 1.0 (a), 1.2 (b), 1.5 (a), 9.0 (b)
    assert found.precision == (1.0, 0.5)
    assert found.chance == 0.5
    assert found.queries == 1


def test_queries_that_could_not_reach_1_are_left_out():
    space, thing = np.arange(5.0)[:, None], np.array(["a", "a", "a", "b", "b"])
    found = precision_at(
        space, thing, np.arange(5), queries=np.arange(5), gallery=np.arange(5), at=(2,)
    )
    assert found.queries == 3
    with pytest.raises(ValueError, match="no thing has 4"):
        precision_at(space, thing, np.arange(5), queries=np.arange(5), gallery=np.arange(5), at=[4])


def test_mean_distances_by_hand():
    space = np.array([[0.0], [3.0], [4.0], [10.0]])
    label, names = np.array(["x", "x", "x", "y"]), np.array(["x", "y"])
    grasp = np.array([1, 2, 2, 3])
    found = mean_distances(space, label, names, grasp)
    assert found[0, 0] == (3 + 4) / 2  # not between the second and third: one grasp
    assert found[0, 1] == found[1, 0] == pytest.approx((10 + 7 + 6) / 3)
    assert np.isnan(found[1, 1])  # there is one of y


def test_silhouette_of_far_clusters_is_nearly_1():
    space = np.concatenate([np.zeros((5, 2)), np.full((5, 2), 9.0)])
    assert silhouette(space, np.repeat([0, 1], 5)) == 1.0
    assert np.isnan(silhouette(space, np.zeros(10)))
    assert np.isnan(silhouette(space, np.arange(10)))
