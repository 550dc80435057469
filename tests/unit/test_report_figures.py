"""What figures show, read back from the drawn figure, and that their files never vary."""

import dataclasses
import subprocess
import sys
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from matplotlib.colors import to_rgba
from matplotlib.text import Text
from report_samples import COST, classes_result, dataset, regression_result, sample_report

from ajgdata.report.canvas import COLOURS, encode, save_figure
from ajgdata.report.comparisons import cost_figure, level_figure, split_figure, tradeoff_figure
from ajgdata.report.content import Cost, ElsewhereResult, Predictions
from ajgdata.report.figures import (
    MAX_VECTOR_POINTS,
    confusion_figure,
    group_by_true_value,
    regression_figure,
    spectra_figure,
)
from ajgdata.report.format import Score
from ajgdata.report.illustrations import illustrations
from ajgdata.types import Level


def texts(figure):
    return [text.get_text() for text in figure.findobj(Text) if text.get_text()]


@pytest.fixture(scope="module")
def drawn():
    return {name: shown.draw() for name, shown in illustrations(sample_report()).items()}


def test_every_figure_says_where_its_data_come_from(drawn):
    stated = {name: {"simulated", "recorded"} & set(texts(f)) for name, f in drawn.items()}
    assert stated == {
        "random-against-grouped": {"simulated"},
        "error-against-run-time": {"simulated", "recorded"},
        "spectra--size": {"simulated"},
        "spectra--stones": {"recorded"},
        "predictions--size--edge--cnn": {"simulated"},
        "predictions--size--edge--knn": {"simulated"},
        "predictions--stones--kind--cnn": {"recorded"},
    }


def fits(figure):
    """Everything ends within the canvas, give or take half the width of a line."""
    box, size = figure.get_tightbbox(), figure.get_size_inches()
    return box.min.min() >= -0.5 / 72 and np.all(box.max <= size + 0.5 / 72)


def test_many_models_of_a_task_are_drawn_against_their_times_in_its_own_unit():
    scores = {"cnn": (3.0, 50.0), "linear": (4.0, 0.2), "knn": (6.0, 1.0), "svm": (3.5, 1.5)}
    task = tuple(
        regression_result(
            model=name, model_label=name, metrics={"rmse": Score(rmse, 0.5)},
            cost=Cost(seconds, 1.0, 100.0),
        )
        for name, (rmse, seconds) in scores.items()
    )  # fmt: skip
    figure = tradeoff_figure(task)
    train = figure.axes[0]
    front = next(line for line in train.lines if line.get_label() == "Pareto front")
    # k-NN is slower and worse than ridge; each other model is the best of those as fast
    np.testing.assert_array_equal(front.get_xydata(), [[0.2, 4.0], [1.5, 3.5], [50.0, 3.0]])
    bars = {c.get_label(): c for c in train.containers}
    assert {name: bars[name].lines[0].get_ydata()[0] for name in scores} == {
        name: rmse for name, (rmse, _) in scores.items()
    }
    assert train.get_ylabel() == "RMSE (mm)"
    assert "simulated" in texts(figure)
    assert fits(figure)
    named = illustrations(dataclasses.replace(sample_report(), results=task))
    assert "models--size--edge" in named
    assert "models--size--edge" not in illustrations(sample_report())


def test_errors_at_several_levels():
    def at(value):
        return Level(value=value, unit="dBA", quantity="sound level outside")

    elsewhere = tuple(
        ElsewhereResult(f"size_{v}", Score(v / 20, 0.3), title=f"at {v}", level=at(v))
        for v in (80, 60)
    )
    result = regression_result(level=at(45), elsewhere=elsewhere)
    figure = level_figure((result,))
    line = figure.axes[0].containers[0].lines[0]
    np.testing.assert_allclose(line.get_xydata(), [[45, 2.2], [60, 3], [80, 4]])
    assert figure.axes[0].get_xlabel() == "sound level outside (dBA)"
    assert fits(figure)
    report = dataclasses.replace(sample_report(), results=(result,))
    named = illustrations(report)["levels--size--edge"]
    assert "CNN: 2.20 ± 0.30 mm at 45 dBA, 3.00 ± 0.30 mm at 60 dBA" in named.caption.alt
    assert "levels--size--edge" not in illustrations(sample_report())


def test_nothing_is_drawn_outside_a_figure(drawn):
    assert {name for name, figure in drawn.items() if not fits(figure)} == set()


def test_long_names_and_many_classes_fit():
    classes = tuple(f"household object {i:02d}" for i in range(16))
    y = np.array(classes)
    long = {"dataset_title": "Materials of spheres, eighty millimetres", "task": "material_class"}
    many = Predictions(y, y, np.zeros(16), classes)
    assert fits(confusion_figure(classes_result(predictions=many, **long)))
    assert fits(confusion_figure(classes_result(**long)))
    assert fits(regression_figure(regression_result(**long)))


def test_the_same_figure_gives_the_same_bytes(tmp_path):
    for draw in (
        lambda: regression_figure(regression_result()),
        lambda: spectra_figure(dataset("size", "simulated")),
    ):
        figure = draw()
        first = [p.read_bytes() for p in save_figure(figure, tmp_path / "a" / "one.figure")]
        again = [p.read_bytes() for p in save_figure(figure, tmp_path / "b")]
        assert first == again
        assert encode(draw(), "svg") == first[0]
        assert [c[:5] for c in first] == [b"<?xml", b"\x89PNG\r", b"%PDF-"]
        assert b"<dc:date>" not in first[0] and b"CreationDate" not in first[2]
    names = sorted(p.name for p in (tmp_path / "a").iterdir())
    assert names == ["one.figure.pdf", "one.figure.png", "one.figure.svg"]


def test_mean_and_deviation_per_true_value():
    y_true = np.array([2.0, 1.0, 2.0, 1.0, 3.0])
    y_pred = np.array([2.0, 1.0, 4.0, 2.0, 9.0])
    true, mean, sd = group_by_true_value(y_true, y_pred)
    assert true.tolist() == [1, 2, 3] and mean.tolist() == [1.5, 3, 9]
    assert sd == pytest.approx([0.5**0.5, 2**0.5, 0], rel=1e-12)


def test_many_true_values_are_binned_without_losing_any():
    y_true = np.random.default_rng(0).uniform(0, 1, 400)
    true, mean, sd = group_by_true_value(y_true, 2 * y_true, max_groups=8)
    assert len(true) == 8 and np.all(np.diff(true) > 0)
    assert mean == pytest.approx(2 * true, rel=1e-12)
    # Uniform in bins of width 1/8, doubled. The sd of 50 uniform values is itself uncertain by
    # sqrt((1.8 - 1) / (4 * 50)) = 6 %; 0.3 is more than four times that.
    assert sd == pytest.approx(np.full(8, 0.25 / 12**0.5), rel=0.3)


def test_regression_figure_draws_predictions_identity_and_score():
    result = regression_result()
    figure = regression_figure(result)
    lines = {line.get_label(): line for line in figure.axes[0].get_lines()}
    assert np.array_equal(lines["one recording"].get_xdata(), result.predictions.y_true)
    assert np.array_equal(lines["one recording"].get_ydata(), result.predictions.y_pred)
    assert np.array_equal(lines["perfect"].get_xdata(), lines["perfect"].get_ydata())
    assert lines["chance: the mean"].get_ydata()[0] == 20
    bars = figure.axes[0].containers[0]
    assert bars.lines[0].get_ydata() == pytest.approx([10, 20, 30])
    # Deviations -1, 1, -3, 3: variance 20 / 3 with n - 1.
    ends = bars.lines[2][0].get_segments()[0][:, 1]
    assert ends == pytest.approx(10 + np.array([-1, 1]) * (20 / 3) ** 0.5, rel=1e-12)
    assert {"RMSE 2.20 ± 0.30 mm   (chance 8.2 mm)", "true edge (mm)"} <= set(texts(figure))


def test_many_points_do_not_bloat_a_vector_file():
    n = MAX_VECTOR_POINTS + 1
    y = np.linspace(0, 1, n)
    few = encode(regression_figure(regression_result()), "svg")
    many = regression_result(predictions=Predictions(y, y, np.zeros(n)))
    assert encode(regression_figure(many), "svg").count(b"<use") < few.count(b"<use") + 200


def test_confusion_figure_shows_counts_and_shares_of_the_true_class():
    figure = confusion_figure(classes_result())
    shares = np.asarray(figure.axes[0].get_images()[0].get_array())
    assert shares == pytest.approx(np.array([[3 / 4, 1 / 4], [2 / 6, 4 / 6]]), rel=1e-12)
    shown = texts(figure)
    assert {"75 %\n3", "25 %\n1", "33 %\n2", "67 %\n4"} <= set(shown)
    assert "accuracy 70.0 ± 5.0 %   (chance 60 %)" in shown
    assert [t.get_text() for t in figure.axes[0].get_yticklabels()] == ["basalt", "<b>granite</b>"]


def test_a_class_that_never_occurs_has_an_empty_row():
    p = classes_result().predictions
    never = Predictions(p.y_true, p.y_pred, p.fold, (*p.classes, "slate"))
    shares = confusion_figure(classes_result(predictions=never)).axes[0].get_images()[0].get_array()
    assert shares[2].tolist() == [0, 0, 0] and shares[:2].sum() == pytest.approx(2)


def test_cost_figure_places_every_result_and_hollows_the_beaten():
    figure = cost_figure(sample_report())
    training, inference = figure.axes
    places = np.array([c.get_offsets()[0] for c in training.collections])
    expected = np.array([(3.2, 2.2 / 8.2), (1e-4, 4 / 8.2), (3.2, 0.3 / 0.4)])
    assert places == pytest.approx(expected, rel=1e-12)
    assert training.get_xscale() == inference.get_xscale() == "log"
    # k-NN is worse but faster: both models of the first task are on its front.
    assert len(training.get_lines()[0].get_xdata()) == 2


def test_cost_figure_hollows_what_is_beaten():
    fast = regression_result()
    slow = regression_result(
        model="slow", metrics={"rmse": Score(4.0, 0.4)}, cost=dataclasses.replace(COST, train_s=9)
    )
    training = cost_figure(dataclasses.replace(sample_report(), results=(slow, fast))).axes[0]
    faces = [tuple(c.get_facecolor()[0]) for c in training.collections]
    assert faces == [to_rgba("white"), to_rgba(COLOURS[0])]
    assert training.get_lines()[0].get_xdata().tolist() == [3.2]


def test_marker_area_grows_with_memory():
    areas = [c.get_sizes()[0] for c in cost_figure(sample_report()).axes[0].collections]
    assert areas[0] == areas[2] > areas[1] > 0


def test_split_figure_pairs_the_two_errors_in_one_unit():
    figure = split_figure(sample_report())
    widths = [bar.get_width() for bars in figure.axes[0].containers for bar in bars.get_children()
              if hasattr(bar, "get_width")]  # fmt: skip
    assert widths == pytest.approx([2.2 / 8.2, 1.1 / 8.2], rel=1e-12)
    assert {"2.20 ± 0.30 mm", "1.10 ± 0.20 mm"} <= set(texts(figure))


def test_split_figure_needs_a_comparison():
    report = dataclasses.replace(sample_report(), results=(classes_result(),))
    with pytest.raises(ValueError, match="compare_random"):
        split_figure(report)
    assert "random-against-grouped" not in illustrations(report)


def test_spectra_are_decibels_about_their_mean():
    data = dataset("size", "simulated")
    mean = data.spectra.mean
    upper, lower = spectra_figure(data).axes[:2]
    level = upper.get_lines()[0].get_ydata()
    overall = mean.mean(axis=0)[1:]  # 0 Hz has no place on a log axis
    assert level == pytest.approx(20 * np.log10(overall / overall.max()), abs=1e-9)
    shown = np.asarray(lower.collections[0].get_array()).reshape(2, -1)
    assert shown == pytest.approx(20 * np.log10(mean[:, 1:] / overall), abs=1e-9)


def test_an_empty_bin_is_silence_not_infinity():
    data = dataset("size", "simulated")
    data.spectra.mean[:, 5] = 0
    level = spectra_figure(data).axes[0].get_lines()[0].get_ydata()
    assert level.min() == pytest.approx(-120)


def test_labels_are_text_and_not_formulas():
    svg = encode(regression_figure(regression_result(model_label="$x^{2$ & <b>")), "svg")
    ET.fromstring(svg)


def test_drawing_leaves_pyplot_alone():
    code = "import sys, ajgdata.report.illustrations; print('matplotlib.pyplot' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"


def test_times_are_labelled_with_plain_numbers_however_few_decades_they_span():
    for slowest in (0.02, 0.9, 300.0):
        slow = regression_result(model="cnn", cost=Cost(slowest, slowest, 100.0))
        fast = regression_result(model="knn", cost=Cost(0.01, 0.01, 100.0))
        whole = sample_report()
        figure = cost_figure(dataclasses.replace(whole, results=(slow, fast)))
        figure.draw_without_rendering()
        for axes in figure.axes[:2]:
            low, high = axes.get_xlim()
            ticks = axes.xaxis.get_major_ticks() + axes.xaxis.get_minor_ticks()
            shown = [t.label1.get_text() for t in ticks if low <= t.get_loc() <= high]
            labels = [text for text in shown if text]
            assert len(labels) >= 1
            assert all(float(text.replace(",", "")) > 0 for text in labels)
