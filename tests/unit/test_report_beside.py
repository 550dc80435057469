"""What stands beside the paper's figures: agreement, cost and reasons, all computed."""

import dataclasses

import numpy as np
import pytest
from ajgdata.report.further import About, ChanceTest, CurveLine, Curves, SortingPart, SortingResult
from report_samples import CLASSES, COST, PAPER, classes_result, regression_result, sample_report

from ajgdata.evaluate.sorting import LONGEST_RUN
from ajgdata.report.beside import absent, beside, evidence
from ajgdata.report.comparison import (
    HIGHER,
    LOWER,
    PARTLY,
    UNCLEAR,
    VAGUE,
    YES,
    Change,
    Reason,
    agreement,
)
from ajgdata.report.content import ElsewhereResult, Predictions, SilentResult
from ajgdata.report.format import Score
from ajgdata.report.illustrations import illustrations
from ajgdata.report.page import render_page
from ajgdata.report.paper import PaperFigure


def figure(name: str, value: float | None, **more) -> PaperFigure:
    given = {"metric": "rmse", "unit": "mm", "text": "as told", "where": f"experiment {name}"}
    return PaperFigure(id=name, value=value, **{**given, **more})


@pytest.mark.parametrize(
    ("paper", "found"), [(1.0, YES), (1.19, YES), (0.81, YES), (1.21, LOWER), (0.79, HIGHER)]
)
def test_two_standard_deviations_decide(paper, found):
    assert agreement(Score(1.0, 0.1), paper) == found


@pytest.mark.parametrize(
    ("mean", "sd", "found"),
    [
        (6.9, 2.9, VAGUE[True]), (3.0, 1.8, VAGUE[False]), (3.0, 1.7, YES),
        (0.1, 1.6, LOWER), (7.2, 1.8, HIGHER),
    ],
)  # fmt: skip
def test_a_spread_that_agrees_with_anything_tells_nothing(mean, sd, found):
    """The paper's 3.5 mm: two deviations must be less."""
    assert agreement(Score(mean, sd), 3.5) == found


def test_what_cannot_be_told_is_given_its_reasons_all_the_same():
    wide = regression_result(metrics={"rmse": Score(3.9, 1.5, (2.4, 5.4))})  # the paper: 2.6
    up, down = reason(1.0, 2.0), reason(5.0, 0.7)
    report = made(reasons=(up, down))
    (row,) = beside(dataclasses.replace(report, results=(wide, *report.results[1:])))
    assert (row.agrees, row.differs, row.why) == (VAGUE[True], True, [down])


def test_more_than_a_bound_agrees_and_one_fold_has_no_spread():
    assert agreement(Score(90.0, 1.0), 80, at_least=True) == YES
    assert agreement(Score(70.0, 1.0), 80, at_least=True) == LOWER
    assert agreement(Score(1.0, float("nan")), 1.01) == LOWER


def made(**changes):
    """The small report, whose CNN errs by 2.2 ± 0.3 mm; the paper says 2.6."""
    return dataclasses.replace(sample_report(), paper=(PAPER, figure("media", 80)), **changes)


def reason(before: float, after: float, *, supported: bool = True) -> Reason:
    test = Change("twice the scatter", "CNN", before, after, supported)
    return Reason(("size",), "the scatter sets the error", "ablations.html#x", (test,))


def test_the_paper_s_model_is_set_beside_its_figure_with_its_cost():
    (row,) = beside(made())
    assert (row.paper, row.model, row.result, row.agrees) == (PAPER, "CNN", "2.20 ± 0.30 mm", YES)
    assert row.cost == COST
    assert [one.id for one in absent(made())] == ["media"]


def test_reasons_are_asked_for_where_results_differ_and_must_point_to_the_paper():
    far = regression_result(metrics={"rmse": Score(1.0, 0.1, (0.9, 1.1))})
    up, down, vague = reason(1.0, 2.0), reason(1.0, 0.5), reason(1.0, 2.1, supported=False)
    report = made(reasons=(up, down, vague))
    report = dataclasses.replace(report, results=(far, *report.results[1:]))
    (row,) = beside(report)
    assert (row.agrees, row.differs) == (LOWER, True)
    assert row.why == [up]
    assert evidence(up) == "twice the scatter (CNN 1 → 2)"
    assert evidence(vague).endswith("within the spread of folds)")
    html = render_page(report, {name: b"<svg/>" for name in illustrations(report)})
    assert '<a href="ablations.html#x">the scatter sets the error</a>: twice the scatter' in html
    assert "experiment media" in html  # reported by the paper, and not here


def test_a_figure_near_chance_agrees_if_a_test_tells_nothing():
    paper = figure("small", None, text="near chance")
    about = About("stones", "kind", "Stones", "recorded")
    null = np.linspace(0.2, 0.8, 99)
    for p, found in ((0.5, YES), (0.01, HIGHER)):
        test = ChanceTest(about, "ridge", "accuracy", "", 0.7, null, p)
        rows = beside(made(results=(classes_result(paper=paper),), tests=(test,)))
        assert [(row.paper.id, row.agrees) for row in rows] == [("small", found)]
        assert rows[0].result.endswith(f"; ridge against chance: p = {p}")  # the CNN's is not known


def test_sorting_is_compared_as_the_paper_did_it():
    """The paper says nothing of scaled probabilities, with which runs here have no end."""
    nothing = np.zeros(0)
    plain, scaled = (
        SortingPart(label, nothing, nothing, 0.1, 1.0, 1.0, sorts, sorts)
        for label, sorts in (("as they are", np.arange(101)), ("scaled", np.full(101, 1000)))
    )
    paper = figure("sorting", 39, unit="sorts")
    about = About("size", "edge", "Sizes", "simulated")
    sorting = SortingResult(about, "cnn", "CNN", ("a", "b"), 0.6, 80, 1.0, (plain, scaled), paper)
    row = next(r for r in beside(made(sorting=(sorting,))) if r.paper is paper)
    assert (row.result, row.agrees) == ("50 (5 to 95) sorts", YES)


@pytest.mark.parametrize(
    ("there", "flagged", "agrees"),
    [(20.0, True, YES), (20.0, False, PARTLY), (2.4, False, f"{UNCLEAR}; no: not flagged")],
)
def test_a_lesson_is_learned_where_a_model_fails_and_silence_says_why(there, flagged, agrees):
    """At home 2.2 ± 0.3 mm: 2.4 is no failure."""
    paper = figure("lesson", None, metric="lesson")
    result = regression_result(
        paper=None,
        elsewhere=(ElsewhereResult("bar", Score(there, 1.0), paper, title="Bar turned"),),
        silent=(SilentResult("quiet", "Silence", "rank correlation", 0.8, 0.2, 9, 0.1, flagged),),
    )
    (row,) = beside(made(results=(result,)))
    assert row.agrees == agrees
    assert row.result.startswith("2.20 ± 0.30 mm where it was trained, ")
    assert row.result.endswith("from silence flagged" if flagged else "from silence not flagged")


def test_baselines_compare_the_baseline_and_name_the_best():
    paper = figure("baselines", 47.5, unit="%")
    knn = classes_result(
        model="knn", model_label="k-NN", paper=paper,
        metrics={"accuracy": Score(0.5, 0.02, (0.48, 0.52))},
    )  # fmt: skip
    (row,) = beside(made(results=(classes_result(paper=paper), knn)))
    assert (row.model, row.agrees) == ("k-NN", YES)
    assert row.result == "50.0 ± 2.0 %; best of 2: CNN, 70.0 ± 5.0 %"


def test_household_objects_are_counted_that_are_told_well():
    """Of basalt 3 of 4 recordings are right, of granite all 6 below."""
    paper = figure("ycb", 70.0, unit="%")
    true = np.repeat(CLASSES, (4, 6))
    predicted = np.array(CLASSES)[[0, 0, 0, 1, *[1] * 6]]
    held_out = Predictions(true, predicted, np.zeros(10, int), CLASSES)
    (row,) = beside(made(results=(classes_result(paper=paper, predictions=held_out),)))
    assert row.result == "70.0 ± 5.0 %; 1 of 2 classes at 90 % or more"
    assert row.agrees == YES


def test_poses_needed_are_those_that_reach_the_paper_s_accuracy():
    paper = figure("data-size", 12, reached=80.0)
    about = About("size", "edge", "Sizes", "simulated")
    for mean, text, agrees in (
        ((50.0, 85.0, 90.0), "8", LOWER),
        ((50.0, 60.0, 81.0), "16", YES),
        ((50.0, 60.0, 70.0), "more than 16", YES),
    ):
        line = CurveLine("CNN", np.array([1, 8, 16]), np.array(mean), np.ones(3))
        curves = Curves(about, "accuracy", "%", 5, 6.0, (line,), paper)
        row = next(r for r in beside(made(curves=(curves,))) if r.paper is paper)
        assert row.result.startswith(f"{text} (")
        assert (row.agrees, row.cost) == (agrees, COST)


@pytest.mark.parametrize(
    ("sorts", "result", "agrees"),
    [
        (range(20, 61), "40 (22 to 58) sorts", YES),
        ([50] * 9, "50 (50 to 50) sorts", HIGHER),
        ([3, 4, LONGEST_RUN], "4 (3.1 to 900) sorts; runs end at 1,000", YES),
    ],
)
def test_sorts_in_a_row_are_told_with_the_end_that_runs_are_given(sorts, result, agrees):
    paper = figure("sorting", 39, unit="sorts")
    bins = np.array([0.5])
    part = SortingPart("scaled", bins, bins, 0.1, 0.9, 0.8, np.array(sorts), np.array(sorts))
    about = About("size", "edge", "Sizes", "simulated")
    sorting = SortingResult(about, "cnn", "CNN", ("a", "b"), 0.6, 80, 0.8, (part,), paper)
    row = next(r for r in beside(made(sorting=(sorting,))) if r.paper is paper)
    assert (row.result, row.agrees) == (result, agrees)
