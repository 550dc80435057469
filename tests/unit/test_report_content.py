"""Normalised errors, the Pareto front, the paper's numbers, and what the nouns refuse."""

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from report_samples import classes_result, regression_result, sample_report

from ajgdata.evaluate.metrics import METRICS
from ajgdata.paths import Paths
from ajgdata.report.content import HEADLINE, Cost, Predictions, Spectra, pareto_front
from ajgdata.report.format import Score, mean_sd, number
from ajgdata.report.paper import parse_paper
from ajgdata.report.wording import headline, prediction_caption, quantity
from ajgdata.store.report_files import read_paper
from ajgdata.types import DataError


def test_headline_is_the_metric_that_evaluation_puts_first():
    assert {kind: names[0] for kind, names in METRICS.items()} == HEADLINE


def test_normalised_error_of_a_regression_is_its_share_of_chance():
    result = regression_result(metrics={"rmse": Score(2.0, 0.5, (1.5, 2.5))}, chance=8.0)
    assert result.error == (0.25, 0.0625, (0.1875, 0.3125))


def test_normalised_error_of_classes_is_the_share_of_avoidable_mistakes():
    result = classes_result(metrics={"accuracy": Score(0.85, 0.03, (0.82, 0.88))}, chance=0.25)
    assert result.error.mean == pytest.approx(0.2, rel=1e-12)
    assert result.error.sd == pytest.approx(0.04, rel=1e-12)
    assert result.error.per_fold == pytest.approx((0.24, 0.16), rel=1e-12)


@pytest.mark.parametrize("sample", [regression_result, classes_result])
def test_chance_is_one_and_perfect_is_zero(sample):
    result = sample()
    perfect = 0.0 if result.kind == "regression" else 1.0
    assert result.normalise(Score(result.chance, 0.0)).mean == pytest.approx(1, rel=1e-12)
    assert result.normalise(Score(perfect, 0.0)).mean == pytest.approx(0, abs=1e-12)


points = st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=1, max_size=12)


@given(points)
def test_pareto_front_agrees_with_its_definition(pairs):
    cost, error = np.array(pairs, float).T
    expected = [not any(a <= c and b <= e and (a, b) != (c, e) for a, b in pairs) for c, e in pairs]
    assert pareto_front(cost, error).tolist() == expected


@given(points)
def test_along_the_front_more_time_means_less_error(pairs):
    cost, error = np.array(pairs, float).T
    front = pareto_front(cost, error)
    assert front[np.lexsort((error, cost))[0]] and front[np.lexsort((cost, error))[0]]
    ordered = sorted({(c, e) for c, e, kept in zip(cost, error, front, strict=True) if kept})
    assert all(e > f for (_, e), (_, f) in itertools.pairwise(ordered))


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"chance": 0.0}, "size/edge/cnn: chance RMSE is 0.0"),
        ({"chance": float("nan")}, "chance RMSE is nan"),
        ({"metrics": {"mae": Score(1.0, 0.1)}}, "needs the metric rmse"),
        ({"metrics": {"rmse": Score(float("nan"), 0.1)}}, "rmse is nan"),
        ({"random_split": Score(1.0, float("inf"))}, "1.0 ± inf"),
    ],
)
def test_a_result_refuses_what_cannot_be_shown(change, complaint):
    with pytest.raises(ValueError, match=complaint):
        regression_result(**change)


def test_classes_need_their_names_and_a_chance_below_one():
    with pytest.raises(ValueError, match="is there one class"):
        classes_result(chance=1.0)
    with pytest.raises(ValueError, match="must list the classes"):
        vector = np.zeros(3)
        classes_result(predictions=Predictions(vector, vector, vector))


def test_predictions_and_spectra_check_their_shapes():
    label = np.array(["a", "b"])
    with pytest.raises(ValueError, match="one length"):
        Predictions(label, label, np.zeros(3), ("a", "b"))
    with pytest.raises(ValueError, match=r"labels \['b'\]"):
        Predictions(label, label, np.zeros(2), ("a",))
    with pytest.raises(ValueError, match="finite"):
        Predictions(np.array([1.0]), np.array([np.nan]), np.zeros(1))
    with pytest.raises(ValueError, match=r"\(2, 3\)"):
        Spectra(np.arange(3.0), ("a", "b"), np.zeros((3, 2)))
    with pytest.raises(ValueError, match="train_s"):
        Cost(-1.0, 0.1, 100.0)


def test_a_report_refuses_unknown_data_sets_other_sources_and_doubles():
    report = sample_report()
    for results, complaint in (
        ((regression_result(dataset="absent"),), "no data set absent"),
        ((regression_result(source="recorded"),), "recorded, but its data set is not"),
        ((regression_result(), regression_result()), "occurs twice"),
    ):
        with pytest.raises(ValueError, match=complaint):
            dataclasses.replace(report, results=results)


def test_tasks_keep_the_models_of_a_task_together():
    tasks = sample_report().tasks()
    assert [[r.where for r in task] for task in tasks] == [
        ["size/edge/cnn", "size/edge/knn"],
        ["stones/kind/cnn"],
    ]
    assert [r.where for r in sample_report().compared()] == ["size/edge/cnn"]


def test_numbers_as_people_write_them():
    assert number(1234.5) == "1,234" and number(0.012345) == "0.0123" and number(20.0) == "20"
    assert number(0) == "0" and number(float("nan")) == "—" and number(-0.5) == "-0.5"
    assert mean_sd(Score(2.634, 0.214), "mm") == "2.63 ± 0.21 mm"
    assert mean_sd(Score(12.6, 3.4), "°") == "12.6 ± 3.4°"
    assert mean_sd(Score(123.4, 25.0)) == "123 ± 25"
    assert mean_sd(Score(2.5, 0.0), "mm") == "2.5 mm"
    assert mean_sd(Score(float("nan"), 0.1)) == "—"
    assert headline(classes_result(metrics={"accuracy": Score(0.856, 0.021)})) == "85.6 ± 2.1 %"


def test_the_unit_is_not_said_twice():
    assert quantity(regression_result(target="edge_mm", unit="mm")) == "edge"
    assert quantity(regression_result(target="bar_angle_deg", unit="°")) == "bar angle"
    assert quantity(regression_result(target="edge", unit="mm")) == "edge"


def test_the_alternative_text_names_the_commonest_confusion():
    alt = prediction_caption(classes_result()).alt
    assert "Most frequent confusion: <b>granite</b> taken for basalt, 2 times." in alt


def paper_content():
    return read_paper(Paths())


def test_paper_figures():
    paper = parse_paper(paper_content())
    values = {name: (f.value, f.unit) for name, f in paper.items() if f.value is not None}
    assert values == {
        "media": (80, "%"),
        "size": (2.6, "mm"),
        "size-known": (2.7, "mm"),
        "size-unknown": (2.4, "mm"),
        "noise": (3.5, "mm"),
        "orientation": (8.0, "°"),
        "orientation-known": (0.6, "°"),
        "materials-sphere80": (90, "%"),
        "materials-plate": (100, "%"),
        "ycb": (85.6, "%"),
        "sorting": (39, "sorts"),
        "data-size": (12, "poses"),
        "baselines": (47.5, "%"),
        "latent-knn": (26.6, "%"),
    }
    assert {name for name in paper if name not in values} == {
        "materials-sphere30", "embedding", "distances", "shortcut", "transfer",
    }  # fmt: skip
    assert {f.source for f in paper.values()} == {"arXiv 2603.00351"}


def test_paper_figures_with_a_mistake_are_refused_in_one_line():
    content = paper_content()
    content["figures"][0]["valeu"] = 3
    with pytest.raises(DataError, match=r"paper.yaml: unknown key figures.0.valeu; correct"):
        parse_paper(content)
    content = paper_content()
    content["figures"].append(content["figures"][1])
    with pytest.raises(DataError, match="listed twice: size"):
        parse_paper(content)


def test_the_caption_says_where_a_repeating_target_is_drawn():
    text = prediction_caption(regression_result(period=180.0, unit="°")).text
    assert "The target repeats after 180°: each prediction is drawn at its repetition" in text
    assert "repeats" not in prediction_caption(regression_result()).text
