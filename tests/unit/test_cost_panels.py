"""Small figures of error against run time: what they draw is what their tables say."""

import numpy as np
import pytest
from drawn_figures import fits, texts
from matplotlib.colors import to_rgba
from result_samples import kind_result, kinds, size_result, sizes, two_tasks

from ajgdata.experiments import EXPERIMENTS
from ajgdata.experiments.cross_validation.cost_panel import task_names
from ajgdata.experiments.cross_validation.results import models_of
from ajgdata.gripper.scene import Numerics
from ajgdata.report.canvas import draw
from ajgdata.report.cost_panels import simulation_panel
from ajgdata.report.format import Score
from ajgdata.types.table import Column, Table


def of_models(*results):
    return EXPERIMENTS["cross_validation"].cost_panel(results)


def points(axes, label):
    """Every point that is drawn under a label."""
    return [tuple(p) for line in axes.lines if line.get_label() == label for p in line.get_xydata()]


def test_models_stand_at_their_training_time_and_normalised_error():
    found = of_models(*two_tasks())
    figure = draw(found)
    (axes,) = figure.axes
    assert sorted(points(axes, "CNN")) == [
        pytest.approx((3.2, 2.2 / 8.2)), pytest.approx((3.2, 0.3 / 0.4)),
    ]  # fmt: skip
    assert points(axes, "k-NN") == [pytest.approx((1e-4, 4 / 8.2))]  # no time was measured
    front = axes.lines[0].get_xydata()
    np.testing.assert_allclose(front, [(1e-4, 4 / 8.2), (3.2, 2.2 / 8.2)])
    assert {"size", "stones", "CNN", "simulated", "recorded"} <= set(texts(figure))
    assert fits(figure)
    assert "CNN errs least on 2 of 2 tasks; it trains 16,000 × as long as the fast" in (
        found.caption.alt
    )  # the median of 3.2 s / 0.1 ms and 1
    assert "size: CNN, 0.27 of chance error in 3.2 s" in found.caption.alt


def test_beaten_models_are_hollow_and_those_of_one_task_named_on_the_front_alone():
    scores = {"cnn": (3.0, 50.0), "linear": (4.0, 0.2), "knn": (6.0, 1.0), "svm": (3.5, 1.5)}
    four = sizes(
        *(
            size_result(name, name.upper(), scores={"rmse": Score(e, 0.5)}, cost=(s, 1.0, 100.0))
            for name, (e, s) in scores.items()
        )
    )
    other = kinds(*(kind_result(name, name.upper()) for name in ("cnn", "linear", "knn")))
    figure = draw(of_models(four, other))
    (axes,) = figure.axes
    faces = {
        (line.get_label(), line.get_xdata()[0]): to_rgba(line.get_markerfacecolor())
        for line in axes.lines
        if line.get_marker() != "None"
    }
    white = to_rgba("white")
    assert {key[0] for key, face in faces.items() if face == white and key[1] != 3.2} == {"KNN"}
    assert "SVM" in texts(figure)
    assert fits(figure)


def test_a_task_that_repeats_another_counts_once():
    more = sizes(size_result(), size_result("knn", "k-NN", scores={"rmse": Score(4, 1)}), task="b")
    alt = of_models(sizes(), more, sizes(task="again")).caption.alt
    assert "on 1 of 1 tasks" in alt
    other = sizes(task="c", results=(size_result(scores={"rmse": Score(3, 1)}),))
    assert "on 2 of 2 tasks" in of_models(sizes(), other).caption.alt
    named = [models_of(task) for task in (sizes(), other, kinds())]
    assert task_names(named) == ["size edge", "size c", "stones"]


def test_without_results_there_is_no_figure():
    assert of_models() is None and of_models(sizes(results=())) is None
    assert EXPERIMENTS["learning_curve"].cost_panel([]) is None
    assert simulation_panel([]) is None
    empty = Table("accuracy", "t", "", (Column("object", "Object"),), ())
    assert simulation_panel([empty]) is None


TODAY = Numerics()


def accuracy(*schemes):
    keys = ("object", "scheme", "dx_mm", "error", "time_s")
    rows = [
        ("cube", "wide", TODAY.dx_mm, 0.08, 0.1),
        ("bar", "wide", TODAY.dx_mm, 0.10, 0.3),
        ("cube", "wide", 2.75, 0.03, 0.6),
        ("cube", "second", 2.5, 0.18, 0.4),
        ("bar", "second", 2.5, 0.18, 0.4),
    ]
    kept = tuple(dict(zip(keys, row, strict=True)) for row in rows if row[1] in schemes)
    return Table("accuracy", "t", "", tuple(Column(key, key) for key in keys), kept)


def test_schemes_stand_at_their_mean_time_and_error_and_the_default_is_ringed():
    assert TODAY.scheme == "wide"
    found = simulation_panel([accuracy("wide", "second")])
    figure = draw(found)
    (axes,) = figure.axes
    assert points(axes, "wide") == [pytest.approx((200, 0.09)), pytest.approx((600, 0.03))]
    assert points(axes, "second") == [pytest.approx((400, 0.18))]
    assert points(axes, "today") == [pytest.approx((200, 0.09))]
    np.testing.assert_allclose(axes.lines[0].get_xydata(), [(200, 0.09), (600, 0.03)])
    assert {"wide scheme", "plain second order", "2.75", f"today\n{TODAY.dx_mm:g}"} <= set(
        texts(figure)
    )
    assert fits(figure)
    alt = found.caption.alt
    assert alt.startswith("Today's grid: 50 % of the error of a plain 2.5 mm grid in 50 % of its")
    assert f"wide scheme at {TODAY.dx_mm:g} mm, today: error 0.09 in 200 ms" in alt
    assert "plain second order at 2.5 mm: error 0.18 in 400 ms" in alt


def test_without_the_plain_kernel_nothing_is_said_of_it():
    found = simulation_panel([accuracy("wide")])
    assert found.caption.alt.startswith("A finer grid errs less and takes longer.")
    assert "today" in [line.get_label() for line in draw(found).axes[0].lines]
