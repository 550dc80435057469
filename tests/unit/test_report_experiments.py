"""What the report says of learning curves, tests against chance and sorting."""

import dataclasses
import re

import numpy as np
from matplotlib.text import Text
from report_samples import regression_result, sample_report

from ajgdata.evaluate.sorting import LONGEST_RUN
from ajgdata.pipeline.report_rows import _scaled
from ajgdata.report.content import ElsewhereResult, SilentResult
from ajgdata.report.energy_figures import energy_figure, energy_rows
from ajgdata.report.experiments import (
    chance_figure,
    chance_text,
    curve_figure,
    sorting_caption,
    sorting_figure,
    spread,
)
from ajgdata.report.format import Score
from ajgdata.report.further import (
    About,
    ChanceTest,
    CurveLine,
    Curves,
    Energies,
    EnergyPart,
    SortingPart,
    SortingResult,
    StftPoint,
    StftResult,
    TransferLine,
    Transfers,
)
from ajgdata.report.illustrations import illustrations
from ajgdata.report.page import render_page
from ajgdata.report.paper import PaperFigure
from ajgdata.report.silent_figures import silent_name
from ajgdata.report.stft import stft_caption, stft_figure

ABOUT = About("size", "edge", "Cube size · edge", "simulated")
LINE = CurveLine("k-NN", np.array([1, 4, 16]), np.array([20.0, 40, 50]), np.array([5.0, 3, 1]))
CURVES = Curves(ABOUT, "accuracy", "%", 5, 25.0, (LINE,))
NULL = np.linspace(0.2, 0.3, 199)
TEST = ChanceTest(ABOUT, "k-NN", "accuracy", "", 0.41, NULL, 0.005)
PARTS = tuple(
    SortingPart(
        label, np.array([0.5, 0.9]), np.array([0.4, 0.8]), error, 0.75, 0.9, sorts, sorts // 2
    )
    for label, error, sorts in (
        ("as they are", 0.2, np.arange(101)),
        ("scaled, temperature 2", 0.05, np.arange(101) // 4),
    )
)
ENERGIES = Energies(
    About("size", "media", "Media", "simulated"),
    "air",
    (100.0, 6000.0),
    (
        EnergyPart("coffee", 1, 0.1, np.nan, {"a": 0.1}),
        EnergyPart("air", 4, 1.0, 0.0, {"a": 1.0, "b": 1.0}),
        EnergyPart("steel_balls", 4, 0.5, 0.05, {"a": 0.45, "b": 0.55}),
    ),
    PaperFigure(id="m", metric="x", value=80, unit="%", text="coffee loses & loses", where="w"),
)
SORTING = SortingResult(ABOUT, "cnn", "CNN", ("lock", "screw"), 0.6, 80, 0.85, PARTS)
POINTS = (
    StftPoint(2048, 512, None, 1025, 0.4, ((40.0, 3.0), (30.0, 2.0))),
    StftPoint(2048, 1024, None, 1025, 0.2, ((45.0, 3.0), (28.0, 2.0))),
    StftPoint(2048, 512, (100.0, 6000.0), 274, 0.4, ((50.0, 3.0), (33.0, 2.0))),
)
STFT = StftResult(ABOUT, ("k-NN", "ridge"), "accuracy", "%", 94.0, POINTS)


def texts(figure):
    return [text.get_text() for text in figure.findobj(Text) if text.get_text()]


def test_a_learning_curve_shows_the_means_of_the_draws():
    figure = curve_figure(CURVES)
    line = figure.axes[0].containers[0].lines[0]
    np.testing.assert_allclose(line.get_xydata(), [[1, 20], [4, 40], [16, 50]])
    assert figure.axes[0].get_ylabel() == "accuracy (%)"
    assert set(figure.axes[0].lines[-1].get_ydata()) == {25.0}  # chance
    assert "simulated" in texts(figure)


def test_a_test_against_chance_shows_where_the_model_stands_among_the_permutations():
    figure = chance_figure(TEST)
    (axes,) = figure.axes
    counted = sum(patch.get_height() for patch in axes.patches)
    assert counted == 199
    mean, value = (line.get_xdata()[0] for line in axes.lines)
    np.testing.assert_allclose([mean, value], [25, 41])
    assert any("differs from chance" in text for text in texts(figure))


def test_a_sorting_figure_shows_reliability_and_the_share_of_runs_as_long():
    figure = sorting_figure(SORTING)
    left, right = figure.axes
    points = next(line for line in left.lines if line.get_label() == "as they are")
    np.testing.assert_allclose(points.get_xydata(), [[0.5, 0.4], [0.9, 0.8]])
    share = dict(right.lines[0].get_xydata())
    assert share[100] == 1 - 100 / 101
    assert not any("$" in text for text in texts(figure))  # ticks of a log axis are formulas
    assert "simulated" in texts(figure)


def test_a_caption_says_which_runs_did_not_end_by_themselves():
    capped = dataclasses.replace(PARTS[1], sorts=np.array([3, LONGEST_RUN, LONGEST_RUN]))
    words = sorting_caption(dataclasses.replace(SORTING, parts=(PARTS[0], capped))).text
    assert "a run of 1,000 is ended there (0 and 2 were)" in words


def test_a_temperature_at_the_end_of_the_search_is_told():
    part = {
        "bins": [], "calibration_error": 0.0, "sorts": [1], "before_mistake": [1],
        "accepted": {"share": 1.0, "accuracy": None},
    }  # fmt: skip
    found = [0.05000002, 0.436, 19.9999]
    label = _scaled({"temperatures": found, "scaled": part}).label
    assert label == "scaled, temperature 0.44, in 2 of 3 folds at the end of the search"
    assert _scaled({"temperatures": [0.9], "scaled": part}).label == "scaled, temperature 0.9"


def test_a_test_against_chance_in_words():
    assert "is 41 %; with labels exchanged between groups it is 25 %" in chance_text(TEST)
    assert "p = 0.005: it differs from chance" in chance_text(TEST)
    assert "cannot be told from chance" in chance_text(dataclasses.replace(TEST, p=0.2))
    error = dataclasses.replace(TEST, metric="rmse", unit="mm", value=2.0, null=20 * NULL)
    assert "RMSE of k-NN, all held-out predictions together, is 2 mm" in chance_text(error)


def test_settings_of_the_stft_show_errors_and_the_front_of_each_model():
    figure = stft_figure(STFT)
    knn, ridge = figure.axes
    front = next(line for line in knn.lines if line.get_label() == "front")
    np.testing.assert_allclose(front.get_xydata(), [[0.2, 45], [0.4, 40]])
    front = next(line for line in ridge.lines if line.get_label() == "front")
    np.testing.assert_allclose(front.get_xydata(), [[0.2, 28]])  # faster and better than its own
    assert "2048/1024" in texts(figure)
    words = stft_caption(STFT).text
    assert "k-NN: 40 % with its own settings, least with 2048/512: 40 %" in words
    assert POINTS[2].label == "2048/512, 0.1–6"


def test_spread():
    assert spread(np.arange(101)) == "50 (5 to 95)"


def test_the_page_holds_them_with_their_task():
    report = dataclasses.replace(
        sample_report(), curves=(CURVES,), tests=(TEST,), sorting=(SORTING,), stfts=(STFT,)
    )
    named = illustrations(report)
    more = {"curve--size--edge", "sorting--size--edge--cnn", "chance--size--edge"}
    assert more <= set(named)
    html = render_page(report, {name: b"<svg/>" for name in named})
    words = re.sub(r"\s+", " ", re.sub("<[^>]*>", " ", html))
    assert "p = 0.005" in words
    assert "as they are 0.2 75 % 90 % 50 (5 to 95) 25 (2 to 47)" in words
    assert "2048 1024 all 1,025 0.2 45 ± 3 28 ± 2" in words
    assert report.experiments("size", "edge") == ((CURVES,), (TEST,), (SORTING,), (), (), (STFT,))
    assert report.experiments("size", "other") == ((), (), (), (), (), ())
    assert report.without_models("size") == []


def test_energies_are_compared_with_the_reference_and_stand_beside_the_paper():
    figure = energy_figure(ENERGIES)
    heights = [bar.get_height() for bar in figure.axes[0].patches]
    np.testing.assert_allclose(heights, [100, 50, 10])  # the reference, then the loudest first
    written = texts(figure)
    assert "50.0 ± 5.0 %\n−3.0 dB" in written and "100 %\n0.0 dB" in written
    assert "simulated" in written
    assert [(row.label, row.value) for row in energy_rows(ENERGIES)] == [
        ("steel balls", "50.0 ± 5.0 %"),
        ("coffee", "10 %"),
    ]
    report = dataclasses.replace(sample_report(), energies=(ENERGIES,))
    assert report.without_models("size") == ["media"]
    named = illustrations(report)
    html = render_page(report, {name: b"<svg/>" for name in named})
    words = re.sub(r"\s+", " ", re.sub("<[^>]*>", " ", html))
    metric = "energy, air = 100 %, over grasps"
    assert f"steel balls {metric} 50.0 ± 5.0 % coffee loses &amp; loses" in words
    assert "Energy lost: steel balls 50 %; coffee 90 %" in words
    assert 'id="energies--size--media"' in html


def test_a_model_that_knows_the_answer_in_silence_is_flagged():
    by_model = {
        "cnn": SilentResult("quiet", "Silence", "rank correlation", 0.8, 0.2, 999, 0.001, True),
        "knn": SilentResult("quiet", "Silence", "rank correlation", 0.1, 0.2, 999, 0.7, False),
    }
    elsewhere = (
        ElsewhereResult("bar", Score(20.0, 1.0), title="Bar turned"),
        ElsewhereResult("quiet", Score(90.0, 1.0), title="Silence"),
    )
    results = tuple(
        regression_result(model=model, model_label=model, silent=(test,), elsewhere=elsewhere)
        for model, test in by_model.items()
    )
    report = dataclasses.replace(sample_report(), results=results)
    (task,) = report.tasks()
    named = illustrations(report)
    figure = named[silent_name(task)].draw()
    left, right = figure.axes
    assert [bar.get_height() for bar in right.patches] == [0.8, 0.1]
    assert [bar.get_height() for bar in left.patches][2:] == [20, 20]  # not what silence gives
    assert {"flagged\np = 0.001", "not flagged\np = 0.7"} <= set(texts(figure))
    text = named[silent_name(task)].caption.text
    assert "cnn on Silence: rank correlation with the truth 0.8" in text
    assert "p = 0.001: flagged: it has learned" in text and "p = 0.7: not flagged." in text
    assert silent_name(task) not in illustrations(sample_report())


def test_a_model_on_another_gripper_against_calibration_grasps():
    lines = tuple(
        TransferLine("k-NN", name, f"Gripper {name}", np.array([0, 4]), mean, 0.1 * mean, home, 9.0)
        for name, mean, home in (
            ("b", np.array([8.0, 2.0]), (1.0, 0.1)),
            ("c", np.array([17.0, 3.0]), (np.nan, np.nan)),
        )
    )
    transfers = Transfers(dataclasses.replace(ABOUT, task="on"), "rmse", "mm", 5, lines)
    report = dataclasses.replace(sample_report(), transfers=(transfers,))
    named = illustrations(report)
    figure = named["transfer--size--on"].draw()
    left, right = figure.axes
    np.testing.assert_allclose(left.containers[0].lines[0].get_xydata(), [[0, 8], [4, 2]])
    levels = [[line.get_ydata()[0] for line in axes.lines if len(set(line.get_ydata())) == 1]
              for axes in (left, right)]  # fmt: skip
    assert left.get_ylim() == right.get_ylim() and right.get_ylim()[1] > 17 * 1.1  # its bar, too
    assert levels == [[1, 9], [9]]  # at home, where it is known, and chance
    assert "simulated" in texts(figure)
    html = render_page(report, {name: b"<svg/>" for name in named})
    words = re.sub(r"\s+", " ", re.sub("<[^>]*>", " ", html))
    assert "RMSE on Gripper b, 0 calibration grasps 8.00 ± 0.80 mm" in words
    assert "RMSE on Gripper c, 4 calibration grasps 3.00 ± 0.30 mm" in words
    assert "k-NN on Gripper b: 8.00 ± 0.80 mm with 0, 2.00 ± 0.20 mm with 4; at home" in html
