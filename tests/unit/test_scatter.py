"""Scatter within classes: analytic sizes and dimensions."""

import numpy as np
import pytest

from ajgdata.evaluate.scatter import within_class_scatter


def test_directions_of_equal_variance_are_counted():
    """Each class scatters by ±1 along each of k axes, around a mean of its own."""
    for k in (1, 2, 5):
        axes = np.eye(8)[:k]
        steps = np.concatenate([axes, -axes])
        values = np.concatenate([steps, steps + 100])
        classes = np.repeat(["a", "b"], 2 * k)
        scatter = within_class_scatter(values, classes)
        assert scatter.dimension == pytest.approx(k)
        # 4k deviations of length 1, of 4k - 2 degrees of freedom, over 8 columns
        assert scatter.rms == pytest.approx(np.sqrt(4 * k / (4 * k - 2) / 8))


def test_a_direction_of_larger_variance_counts_more():
    values = np.array([[3.0, 0], [-3, 0], [0, 1], [0, -1]])
    scatter = within_class_scatter(values, ["a"] * 4)
    assert scatter.dimension == pytest.approx((18 + 2) ** 2 / (18**2 + 2**2))


def test_classes_of_one_row_have_no_scatter():
    assert within_class_scatter([[1.0], [3], [9]], ["a", "a", "b"]).rms == pytest.approx(np.sqrt(2))
    with pytest.raises(ValueError, match="no class has two rows"):
        within_class_scatter([[1.0], [2]], ["a", "b"])
