"""Projections find known structure, learn from training points only, and repeat themselves."""

import numpy as np
import pytest
from sklearn.metrics import silhouette_score

from ajgdata.embed.projections import FEWEST, METHODS, project
from ajgdata.types import NotPossibleError

cluster = np.repeat([0, 1, 2], 20)
TRAINING = np.arange(60) % 4 != 0


@pytest.fixture(scope="module")
def points():
    """Three clusters, ten times their width apart, in twelve dimensions."""
    rng = np.random.default_rng(0)
    centres = 10 * np.linalg.qr(rng.standard_normal((12, 12)))[0][:3]
    return (centres[cluster] + rng.standard_normal((60, 12)) / 3).astype(np.float32)


@pytest.fixture(scope="module")
def planes(points):
    return project(points, TRAINING, seed=3)


def test_clusters_stay_clusters_with_the_points_that_were_not_learned_from(planes):
    assert list(planes) == list(METHODS)
    for name, plane in planes.items():
        assert plane.shape == (60, 2) and plane.dtype == np.float32
        # of two points of one cluster and one of another, the two are nearest: 0.5 is generous
        assert silhouette_score(plane, cluster) > 0.5, name
        centres = np.stack([plane[TRAINING & (cluster == k)].mean(axis=0) for k in range(3)])
        nearest = np.linalg.norm(plane[:, None] - centres, axis=2).argmin(axis=1)
        np.testing.assert_array_equal(nearest, cluster, err_msg=name)


def test_pca_is_the_plane_of_greatest_variance_of_the_training_points(points, planes):
    centred = points.astype(float) - points[TRAINING].mean(axis=0)
    _, singular, directions = np.linalg.svd(centred[TRAINING], full_matrices=False)
    expected = centred @ directions[:2].T
    signs = np.sign((expected * planes["pca"]).sum(axis=0))
    # float32 coordinates of size 10
    np.testing.assert_allclose(planes["pca"], signs * expected, atol=1e-4)
    spread = np.linalg.norm(planes["pca"][TRAINING], axis=0)
    np.testing.assert_allclose(spread, singular[:2], rtol=1e-5)


def test_what_is_held_out_teaches_nothing(points, planes):
    moved = points.copy()
    moved[~TRAINING] = moved[~TRAINING][::-1]
    again = project(moved, TRAINING, seed=3)
    for name in ("pca", "umap"):
        np.testing.assert_array_equal(again[name][TRAINING], planes[name][TRAINING], err_msg=name)


def test_few_points_get_pca_only(points):
    few = project(points[:FEWEST], np.arange(FEWEST) > 0)
    assert list(few) == ["pca"]


def test_two_training_points_are_needed():
    with pytest.raises(NotPossibleError, match="two training points"):
        project(np.zeros((3, 2)), np.array([True, False, False]))
