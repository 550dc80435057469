"""What figures of cross-validation show, read back from them."""

import numpy as np
import pytest
from result_samples import (
    SIZES,
    kinds,
    size_result,
    sizes,
)

from ajgdata.experiments.cross_validation import EXPERIMENT
from ajgdata.experiments.cross_validation.figures import binned
from ajgdata.report.canvas import styled
from ajgdata.report.format import Score


def title(figure):
    """The head of a figure, its lines joined."""
    bold = [text for text in figure.texts if text.get_fontweight() == "bold"]
    return " ".join(text.get_text() for text in bold if text.get_color() != "white")


def drawn_prediction(results):
    """The predictions of the first model."""
    return styled(next(iter(EXPERIMENT.figures(results))).draw)()


def markers(axes):
    """Places (n, 2) of the points of a panel, series after series."""
    found = [c.lines[0].get_xydata() for c in axes.containers]
    return np.concatenate([one for one in found if len(one)])


def test_many_true_values_are_binned_without_losing_any():
    y_true = np.random.default_rng(0).uniform(0, 1, 400)
    places = binned(y_true, 8)
    assert len(np.unique(places)) == 8 and len(places) == 400
    assert np.abs(places - y_true).max() < 1 / 8
    assert places.mean() == pytest.approx(y_true.mean(), rel=1e-12)
    assert binned(np.array([2.0, 1.0, 2.0]), 8).tolist() == [2, 1, 2]


def test_predictions_of_numbers_are_means_beside_the_identity():
    unseen = (np.array([15.0, 15.0]), np.array([14.0, 17.0]))
    errors = np.tile([-1.0, 1.0, -3.0, 3.0], 3)
    predictions = {"grouped": (SIZES, SIZES + errors), "withheld": unseen}
    parts = {"withheld": ({"rmse": Score(3.5, 0.4)}, 9.0)}
    figure = drawn_prediction(sizes(size_result(parts=parts, predictions=predictions)))
    axes = figure.axes[0]
    np.testing.assert_allclose(markers(axes), [[10, 10], [20, 20], [30, 30], [15, 15.5]])
    # Deviations -1, 1, -3, 3: variance 20 / 3 with n - 1.
    ends = axes.containers[0].lines[2][0].get_segments()[0][:, 1]
    assert ends == pytest.approx(10 + np.array([-1, 1]) * (20 / 3) ** 0.5, rel=1e-12)


def test_confusion_figure_shows_shares_of_the_true_class():
    figure = drawn_prediction(kinds())
    shares = np.asarray(figure.axes[0].get_images()[0].get_array())
    assert shares == pytest.approx(np.array([[3 / 4, 1 / 4], [2 / 6, 4 / 6]]), rel=1e-12)
    assert "CNN: accuracy 70.0 ± 5.0 % (chance 60 %)" in title(figure)
    assert "<b>granite</b> is taken for basalt 2 times" in title(figure)


def test_a_repeating_target_is_drawn_at_the_repetition_nearest_to_the_truth():
    predictions = {"grouped": (np.array([5.0, 175.0, 90.0]), np.array([178.0, 2.0, 80.0]))}
    task = sizes(size_result(predictions=predictions), period_deg=180.0, unit="°")
    drawn = drawn_prediction(task)
    np.testing.assert_allclose(markers(drawn.axes[0]), [[5, -2], [90, 80], [175, 182]])
