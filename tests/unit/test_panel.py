"""Panels of the first screen: what is drawn where, and the stance that a verdict becomes."""

import dataclasses
import math

import pytest
from report_samples import PAPER

from ajgdata.evaluate.agreement import VERDICTS
from ajgdata.report.comparison import Mark, PaperComparison, mark_of, range_of
from ajgdata.report.format import Score
from ajgdata.report.panel import SIGNS, Highlight, highlight_panel, panels, said


def compared(agrees="agrees", marks=(), **changes):
    paper = changes.pop("paper", PAPER)
    return PaperComparison(paper, "d", "t", "simulated", "text", "CNN", agrees, marks=marks,
                           page="experiments/d.html", **changes)  # fmt: skip


@pytest.mark.parametrize(
    ("verdicts", "stance", "words"),
    [
        (["agrees"], "agrees", "agrees"),
        (["worse", "worse"], "worse", "worse"),
        (["better", "agrees", "better"], "mixed", "1 agrees, 2 better"),
        (["inconclusive", "partly agrees"], "mixed", "1 partly agrees, 1 inconclusive"),
    ],
)
def test_a_panel_has_the_verdict_of_its_rows_or_counts_them(verdicts, stance, words):
    (panel,) = panels([compared(verdict) for verdict in verdicts], [PAPER])
    assert (panel.stance, panel.verdict) == (stance, words)


def test_every_verdict_has_a_sign_and_its_own_word():
    assert {SIGNS[verdict][1] for verdict in VERDICTS} == set(VERDICTS)
    assert panels([], [PAPER])[0].verdict == SIGNS["absent"][1]


def test_an_interval_is_said_as_a_deviation_or_as_a_range():
    assert said(mark_of("ours", "CNN", Score(0.72, 0.12)), "mm") == "0.72 ± 0.12 mm"
    assert said(mark_of("ours", "CNN", Score(0.5, math.nan), 100), "%") == "50 %"
    assert said(range_of("ours", "all", [1, 2, 6]), "sorts") == "3 (1 to 6) sorts"
    assert said(Mark("ours", "CNN", math.inf, 16, math.inf), "poses") == "> 16 poses"


def test_figures_of_one_title_share_a_panel_its_scale_and_differ_in_rows():
    known = PAPER.model_copy(update={"panel": "Size", "row": "known", "value": 2.0})
    new = PAPER.model_copy(update={"id": "size-unknown", "panel": "Size", "row": "withheld"})
    found = [
        compared("worse", (mark_of("ours", "CNN", Score(1.0, 0.0)),), paper=known),
        compared("agrees", (mark_of("ours", "CNN", Score(3.0, 0.5)),), paper=new),
    ]
    (panel,) = panels(found, [known, new])
    assert panel.tall and panel.stance == "mixed" and panel.link == "experiments/d.html"
    assert [(row.label, row.ours, row.paper) for row in panel.rows] == [
        ("known", "1 mm", "paper 2"), ("withheld", "3.00 ± 0.50 mm", "paper 2.6"),
    ]  # fmt: skip
    assert panel.span("mm") == (0, pytest.approx(3.5 * 1.06))
    (ours, paper) = panel.placed(panel.rows[1])
    assert (ours.at, ours.start, ours.width) == pytest.approx(
        [100 * v / 3.71 for v in (3.0, 2.5, 1.0)], abs=0.02
    )
    assert paper.mark.role == "paper" and paper.width == 0


def test_rows_of_other_units_have_their_own_scale_and_shares_the_whole():
    paper = PAPER.model_copy(update={"value": None, "panel": "Gripper"})
    found = [
        compared(marks=(mark_of("ours", "a", Score(0.2, 0.0), 100),), paper=paper, shown_unit="%"),
        compared(marks=(mark_of("ours", "b", Score(5.0, 0.0)),), paper=paper, shown_unit="mm"),
    ]
    (panel,) = panels(found, [paper])
    assert [panel.placed(row)[0].at for row in panel.rows] == [20, pytest.approx(100 / 1.06, 0.01)]


def test_parts_of_one_result_are_rows_and_what_is_not_finite_is_not_drawn():
    paper = PAPER.model_copy(update={"value": None})
    marks = (
        mark_of("ours", "within", Score(1.0, 0.1), part="round"),
        mark_of("other", "others", Score(2.0, 0.1), part="round"),
        mark_of("ours", "within", Score(math.nan, math.nan), part="long"),
    )
    (panel,) = panels([compared(marks=marks, paper=paper)], [paper])
    assert [(row.label, row.paper) for row in panel.rows] == [("round", "others 2"), ("long", "")]
    assert [len(panel.placed(row)) for row in panel.rows] == [2, 0]


def test_values_below_zero_and_all_zero_have_a_scale():
    highlight = Highlight("Gain", "said", "", (mark_of("ours", "a", Score(-1.0, 0.0)),))
    panel = highlight_panel(highlight, "run.html", "recorded")
    assert panel.placed(panel.rows[0])[0].at == 0
    nothing = Highlight("Gain", "said", "", (mark_of("ours", "a", Score(0.0, 0.0)),))
    assert highlight_panel(nothing, "", "recorded").placed(panel.rows[0])[0].at == 0


def test_simulated_and_recorded_results_have_panels_of_their_own():
    marks = (mark_of("ours", "CNN", Score(1.0, 0.0)),)
    recorded = dataclasses.replace(compared("worse", marks), source="recorded")
    found = [compared(marks=marks), recorded]
    told = [(panel.source, panel.stance, len(panel.rows)) for panel in panels(found, [PAPER])]
    assert told == [("recorded", "worse", 1), ("simulated", "agrees", 1)]


def test_rows_without_a_name_have_that_of_their_data_set():
    marks = (mark_of("ours", "CNN", Score(1.0, 0.0)),)
    found = [compared(marks=marks), dataclasses.replace(compared(marks=marks), dataset="my_own")]
    (panel,) = panels(found, [PAPER])
    assert [row.label for row in panel.rows] == ["d", "my own"]


def test_more_than_all_that_was_tried_is_drawn_from_there_on():
    paper = PAPER.model_copy(update={"unit": "poses", "value": 12})
    found = compared("inconclusive", (Mark("ours", "CNN", math.inf, 16.0, math.inf),), paper=paper)
    (panel,) = panels([found], [paper])
    ours, _ = panel.placed(panel.rows[0])
    assert (ours.at, ours.start) == pytest.approx([100 / 1.06] * 2, abs=0.01)
    assert ours.start + ours.width == 100 and ours.words == "CNN > 16 poses"
