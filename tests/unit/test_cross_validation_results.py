"""Results of cross-validation read back, as rows and tables, and beside the paper."""

import dataclasses

import numpy as np
import pytest
from result_samples import (
    COST,
    PAPER,
    SIZES,
    kind_result,
    kinds,
    paper_figure,
    random_split,
    size_result,
    sizes,
    two_tasks,
)
from test_shortcut import silence

from ajgdata.evaluate.parts import placebo
from ajgdata.experiments.base import Other
from ajgdata.experiments.cross_validation import EXPERIMENT
from ajgdata.experiments.cross_validation_results import (
    best_of,
    models_of,
    run_times,
    shown_model,
    summary,
)
from ajgdata.experiments.plots import binned
from ajgdata.report.canvas import styled
from ajgdata.report.format import Score
from ajgdata.types import CrossValidationSettings as Settings


def nothing(experiment, dataset, task):
    return None


def comparisons(results, lookup=nothing):
    return list(EXPERIMENT.paper_comparison(results, lookup))


def title(figure):
    """The head of a figure, its lines joined."""
    bold = [text for text in figure.texts if text.get_fontweight() == "bold"]
    return " ".join(text.get_text() for text in bold if text.get_color() != "white")


def drawn_prediction(results):
    """The predictions of the first model."""
    return styled(next(iter(EXPERIMENT.figures(results))).draw)()


def markers(axes):
    """Places (n, 2) of the points of a panel, series after series."""
    series = [c.lines[0].get_xydata() for c in axes.containers]
    return np.concatenate([points for points in series if len(points)])


@pytest.mark.parametrize(("rmse", "is_as_good"), [(0.1, True), (50.0, False)])
def test_a_task_is_never_about_the_model_without_the_sound(rmse, is_as_good):
    scores = {"rmse": Score(rmse, 0.01)}
    alone = size_result("covariates_alone", "covariates alone", scores=scores)
    knn = size_result("knn", "k-NN")
    results = sizes(alone, knn, papers={}, covariates=("force_n",))
    assert best_of(models_of(results)).label == shown_model(results).label == "k-NN"
    assert [row.label for row in EXPERIMENT.rows(results) if row.best] == ["k-NN"]
    text = summary(results)
    assert "Lowest error: k-NN" in text
    assert ("This is at least as good as k-NN with the sound." in text) == is_as_good
    only = sizes(alone, papers={}, covariates=("force_n",))
    assert shown_model(only).label == "covariates alone"
    assert "at least as good" not in summary(only)


def test_rows_of_a_task_stand_beside_the_paper_with_the_best_marked():
    results = two_tasks()[0]
    assert len(list(EXPERIMENT.rows(results))) == 2  # the paper has no value of the random split
    papers = {"known": PAPER, "known_by_recording": PAPER}
    cnn, knn, recording = EXPERIMENT.rows(dataclasses.replace(results, papers=papers))
    assert (cnn.label, cnn.metric, cnn.value, cnn.chance) == (
        "CNN",
        "RMSE",
        "2.20 ± 0.30 mm",
        "8.2 mm",
    )
    assert (cnn.train_cpu_s, cnn.prediction_ms) == ("3.2", "0.21")
    assert (knn.train_cpu_s, knn.prediction_ms) == ("0", "0.05")
    assert (knn.value, knn.paper, cnn.paper) == ("4.00 ± 0.40 mm", PAPER, PAPER)
    assert (cnn.best, knn.best, cnn.part) == (True, False, "")
    assert (cnn.answer, knn.answer) == ("2.2 (1.75 to 2.65) mm", "")
    assert (recording.metric, recording.value) == ("RMSE, known by recording", "1.10 ± 0.20 mm")
    assert "split by recording" in recording.part and recording.paper is PAPER
    (row,) = EXPERIMENT.rows(kinds())
    assert (row.metric, row.value, row.paper) == ("accuracy", "70.0 ± 5.0 %", None)


def with_parts():
    """A task with withheld values, tested on another data set, with the paper's figures."""
    parts = {
        "withheld": ({"rmse": Score(3.5, 0.4)}, 9.0),
        "overall": ({"rmse": Score(2.4, 0.2)}, 8.4),
        "on:size_80dba": ({"rmse": Score(5.0, 1.0)}, 8.5),
    }
    names = ("known", "unknown", "overall", "size_80dba")
    return sizes(
        size_result(parts=parts),
        settings=Settings(test_on=("size_80dba",)),
        other_sets={"size_80dba": Other("Sizes at 80 dBA")},
        papers={name: paper_figure(name.replace("_", "-"), 2.6) for name in names},
    )


def test_a_result_that_is_not_better_than_chance_says_so():
    """Withheld angles: 54° where a guess errs by 41°; and an interval that contains chance."""
    parts = {
        "withheld": ({"rmse": Score(54.0, 5.0)}, 41.0),
        "on:a": ({"rmse": Score(35.0, 5.0)}, 41.0),
        "on:b": ({"rmse": Score(33.0, 5.0)}, 41.0),
    }
    names = {"unknown": paper_figure("unknown", 8.0, unit="°")}
    task = sizes(
        size_result(parts=parts),
        unit="°",
        papers=names,
        settings=Settings(test_on=("a", "b")),
        other_sets={"a": Other("A"), "b": Other("B")},
    )
    _, withheld, near, better = EXPERIMENT.rows(task)
    assert withheld.value == "54.0 ± 5.0°, not better than chance"
    assert near.value == "35.0 ± 5.0°, not better than chance"
    assert better.value == "33.0 ± 5.0°"
    (row,) = comparisons(task)
    assert (row.result, row.agrees) == ("54 (46.5 to 61.5)°, not better than chance", "worse")


def test_the_paper_s_model_is_set_beside_its_figure_with_its_cost():
    (row,) = comparisons(two_tasks()[0])
    assert (row.paper, row.model, row.agrees) == (PAPER, "CNN", "agrees")
    assert row.result == "2.2 (1.75 to 2.65) mm"  # what the verdict is about
    assert (row.dataset, row.task, row.source) == ("size", "edge", "simulated")
    assert row.cost == COST[:2]
    assert (row.marks[0].low, row.marks[0].high) == pytest.approx((1.75, 2.65))
    marks = [(mark.role, mark.value) for mark in row.marks]
    assert marks == [("ours", 2.2), ("baseline", 4.0), ("chance", 8.2)]
    assert comparisons(kinds()) == []
    # A quarter of the distance from chance to perfect: 8.2 / 4 = 2.05 mm.
    wide = sizes(size_result(scores={"rmse": Score(2.9, 0.7, (2.4, 3.4))}))
    assert [row.agrees for row in comparisons(wide)] == ["inconclusive"]


def test_each_part_is_set_beside_its_own_figure():
    rows = {row.paper.id: (row.result, row.agrees) for row in comparisons(with_parts())}
    assert rows == {
        "known": ("2.2 (1.75 to 2.65) mm", "agrees"),
        "unknown": ("3.5 (2.9 to 4.1) mm", "worse"),
        "overall": ("2.4 (2.1 to 2.7) mm", "agrees"),
        "size-80dba": ("5 (3.5 to 6.5) mm", "worse"),
    }


def test_known_values_stand_beside_the_paper_by_grasp_and_by_recording_and_each_is_judged():
    papers = {name: paper_figure("known", 1.2) for name in ("known", "known_by_recording")}
    task = sizes(size_result(parts=random_split()), papers=papers)
    grasp, recording = comparisons(task)
    assert [(row.split, row.label) for row in (grasp, recording)] == [
        ("grouped split", "new grasps"),
        ("random split", "grasps also in training"),
    ]
    # 2.2 ± 0.3 and 1.1 ± 0.2 mm beside 1.2 mm.
    assert (grasp.agrees, recording.agrees) == ("worse", "agrees")


def test_classes_are_compared_in_per_cent_and_a_figure_without_a_number_is_told_alone():
    for value, agrees in ((70.0, "inconclusive"), (78.0, "worse"), (None, "inconclusive")):
        paper = paper_figure("stones", value, unit="%")
        assert [row.agrees for row in comparisons(kinds(papers={"known": paper}))] == [agrees]


@pytest.mark.parametrize(
    ("there", "flagged", "agrees"),
    [
        (20.0, True, "agrees"),
        (20.0, False, "partly agrees"),
        (2.4, None, "inconclusive"),
    ],
)
def test_a_lesson_is_learned_where_a_model_fails_and_silence_says_why(there, flagged, agrees):
    """At home 2.2 ± 0.3 mm: 2.4 is no failure."""

    def lookup(*where):
        return None if flagged is None else silence(cnn=flagged, knn=True)

    paper = paper_figure("lesson", None, metric="lesson")
    parts = {"on:bar": ({"rmse": Score(there, 1.0)}, 9.0)}
    task = sizes(
        size_result(parts=parts),
        papers={"bar": paper},
        settings=Settings(test_on=("bar",)),
        other_sets={"bar": Other("Bar turned")},
    )
    (row,) = comparisons(task, lookup)
    assert row.agrees == agrees
    assert row.result.startswith("2.20 ± 0.30 mm where it was trained, ")


# Figures


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
    caption = next(iter(EXPERIMENT.figures(kinds()))).caption.text
    assert "share of the recordings of a true class" in caption
    assert "±" not in caption


def test_the_mean_of_the_true_values_is_a_guess_and_no_chance_level():
    """The chance level of a size is an error; the line in the figure is a predicted size."""
    caption = next(iter(EXPERIMENT.figures(sizes()))).caption.text
    assert f"A guess predicts {SIZES.mean():g} mm." in caption
    assert "Chance" not in caption


def test_the_advice_names_the_pairs_that_are_confused_most():
    """Of 4 basalts one is predicted as granite, of 6 granites two as basalt."""
    first, second = EXPERIMENT.advice(kinds())
    assert first.startswith("33 % of the recordings of <b>granite</b> are predicted as basalt: ")
    assert second.startswith("25 % of the recordings of basalt are predicted as <b>granite</b>: ")
    assert list(EXPERIMENT.advice(sizes())) == []


def test_a_repeating_target_is_drawn_at_the_repetition_nearest_to_the_truth():
    predictions = {"grouped": (np.array([5.0, 175.0, 90.0]), np.array([178.0, 2.0, 80.0]))}
    task = sizes(size_result(predictions=predictions), period_deg=180.0, unit="°")
    drawn = drawn_prediction(task)
    np.testing.assert_allclose(markers(drawn.axes[0]), [[5, -2], [90, 80], [175, 182]])


def test_the_error_of_each_model_is_drawn_over_its_training_time():
    sizes_task, kinds_task = two_tasks()
    rows = run_times(sizes_task).rows
    assert [(row["model"], row["train_cpu_s"], row["error"]) for row in rows] == [
        ("CNN", 3.2, 1.9),
        ("CNN", 3.2, 2.5),
        ("k-NN", 1e-3, 3.6),
        ("k-NN", 1e-3, 4.4),
    ]
    assert run_times(kinds_task).rows == ()  # of one model
    accurate = kinds(kind_result(), kind_result("knn", "k-NN"))
    assert run_times(accurate).column("error") == pytest.approx([35, 25, 35, 25])
    names = [figure.name for figure in EXPERIMENT.figures(sizes_task)]
    assert names == [f"cross-validation--size--edge--{n}" for n in ("predictions", "run-time")]


def test_a_placebo_of_fewer_names_is_converted_by_its_skill():
    """Three names at 60 % have the skill 0.4 above a third; of ten classes this is 46 %."""
    few = {placebo("few"): ({"accuracy": Score(0.6, 0.05)}, 1 / 3)}
    result = kind_result(parts=few, chance=0.1, score=Score(0.9, 0.1))
    (model,) = models_of(kinds(result, settings=Settings(placebo="few")))
    level = model.placebo()
    assert level.mean == pytest.approx(0.1 + 0.4 * 0.9)
    # ends of the samples: 1.5 standard deviations, converted by (1 - 0.1) / (1 - 1 / 3)
    assert level.high - level.mean == pytest.approx(1.5 * 0.05 * 1.35)
    assert model.beats_chance()
    assert model.placebo("withheld") is None
