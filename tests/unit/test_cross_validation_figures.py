"""What figures of cross-validation show, read back from them."""

import numpy as np
import pytest
from result_samples import (
    SIZES,
    kinds,
    size_result,
    sizes,
)

from ajgdata.experiments.base import Other
from ajgdata.experiments.cross_validation import EXPERIMENT, Settings
from ajgdata.experiments.cross_validation.figures import binned
from ajgdata.report.canvas import styled
from ajgdata.report.format import Score
from ajgdata.report.paper import PaperFigure
from ajgdata.types import Level


def folds_around(mean: float, sd: float) -> Score:
    """Return a score of two folds."""
    off = sd / 2**0.5
    return Score(mean, sd, (mean - off, mean + off))


def title(figure):
    """The head of a figure, its lines joined."""
    bold = [text for text in figure.texts if text.get_fontweight() == "bold"]
    return " ".join(text.get_text() for text in bold if text.get_color() != "white")


def illustrated(*results):
    """The illustrations of tasks, and of all of them together, by name."""
    listed = [one for task in results for one in EXPERIMENT.figures(task)]
    return {one.name: one for one in (*listed, *EXPERIMENT.across(results))}


def drawn_of(name, *results):
    return styled(illustrated(*results)[name].draw)()


def prediction_of(results):
    """The predictions of the first model."""
    return next(iter(EXPERIMENT.figures(results)))


def drawn_prediction(results):
    return styled(prediction_of(results).draw)()


def markers(axes):
    """Places (n, 2) of the points of a panel, series after series."""
    found = [c.lines[0].get_xydata() for c in axes.containers]
    return np.concatenate([one for one in found if len(one)])


def test_errors_at_several_levels():
    def at(value):
        return Level(value=value, unit="dBA", quantity="sound level outside")

    known = PaperFigure(id="size-known", metric="rmse", value=2.7, unit="mm", text="t", where="w")
    parts = {f"on:size_{v}": ({"rmse": folds_around(v / 20, 0.3)}, 9.0) for v in (80, 60)}
    others = {f"size_{v}": Other(f"at {v}", at(v)) for v in (80, 60)}
    task = sizes(
        size_result(parts=parts), level=at(45), papers={"known": known}, others=others,
        settings=Settings(test_on=tuple(others)),
    )  # fmt: skip
    figure = drawn_of("cross-validation--size--edge--levels", task)
    axes = figure.axes[0]
    np.testing.assert_allclose(markers(axes), [[45, 2.2], [60, 3], [80, 4]])
    star = next(line for line in axes.get_lines() if line.get_marker() == "*")
    np.testing.assert_allclose(star.get_xydata(), [[45, 2.7]])


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
