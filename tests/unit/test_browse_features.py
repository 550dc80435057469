"""Features on the page: means of classes, planes and novelty with known answers."""

import numpy as np
import pytest

from ajgdata.browse.features import ClassCurves, Features, novelty
from ajgdata.store.feature_array import CHANNEL, Axis, channel_axis, frequency_axis
from ajgdata.store.features import FeatureRows, text_column


def features(values, *axes):
    names = [f"s/{number}" for number in range(len(values))]
    columns = {"recording": text_column(names)}
    return Features(FeatureRows(np.asarray(values, np.float32), axes, columns, {}))


def test_the_mean_of_the_class_is_without_the_recording():
    curves = np.array([[1.0, 0.0], [3.0, 0.0], [5.0, 0.0], [0.0, 1.0], [0.0, 3.0]], np.float32)
    compared = ClassCurves(curves, ["a", "a", "a", "b", "b"]).compared(0)
    assert compared.label == "a"
    np.testing.assert_allclose(compared.of_label, [4, 0])
    assert compared.nearest == "b"
    np.testing.assert_allclose(compared.of_nearest, [0, 2])


def test_the_nearest_other_class():
    curves = np.array([[1.0], [1.1], [2.0], [9.0]], np.float32)
    compared = ClassCurves(curves, ["a", "", "near", "far"]).compared(0)
    assert compared.of_label is None  # the only recording of its class
    assert compared.nearest == "near"


@pytest.mark.parametrize("labels", [["a", "a"], ["", ""]])
def test_without_another_class_there_is_no_nearest_one(labels):
    compared = ClassCurves(np.ones((2, 3), np.float32), labels).compared(1)
    assert (compared.nearest, compared.of_nearest) == ("", None)


def test_a_curve_is_the_mean_over_channels_and_time():
    values = np.arange(2 * 2 * 3 * 2, dtype=float).reshape(2, 2, 3, 2)
    axes = (
        channel_axis((1, 2)),
        frequency_axis(np.array([1.0, 2.0, 3.0])),
        Axis("time", np.arange(2)),
    )
    shown = features(values, *axes)
    assert shown.axis.name == "frequency"
    np.testing.assert_allclose(shown.curves, values.mean(axis=(1, 3)))


def test_a_feature_without_frequency_is_drawn_over_its_first_dimension():
    axes = (channel_axis((1, 2)), Axis("coefficient", np.arange(4)))
    shown = features(np.ones((3, 2, 4)), *axes)
    assert (shown.axis.name, shown.curves.shape) == ("coefficient", (3, 4))
    assert CHANNEL not in shown.axis.name


def test_the_plane_separates_two_clusters_along_x():
    generator = np.random.default_rng(0)
    values = generator.uniform(0.9, 1.1, (40, 6))
    values[20:] *= 3
    plane = features(values, frequency_axis(np.arange(6.0))).plane
    assert plane.shape == (40, 2)
    first, second = np.sort([plane[:20, 0].mean(), plane[20:, 0].mean()])
    assert second - first > 5 * plane[:20, 0].std()


def test_a_feature_of_one_value_has_a_plane():
    plane = features([[1.0], [2.0], [4.0]], frequency_axis(np.array([5.0]))).plane
    assert plane.shape == (3, 2)
    assert (plane[:, 1] == 0).all()


def test_novelty_ignores_recordings_of_the_same_grasp():
    points = np.array([[0.0], [0.1], [1.0], [2.0]], np.float32)
    assert novelty(points, ["a", "a", "b", "c"]) == pytest.approx([1, 0.9, 0.9, 1], rel=0.06)


def test_one_grasp_has_no_novelty():
    assert np.isnan(novelty(np.zeros((2, 3), np.float32), ["a", "a"])).all()


def test_equal_recordings_have_no_novelty():
    assert novelty(np.zeros((3, 2), np.float32), ["a", "b", "c"]).tolist() == [0, 0, 0]
