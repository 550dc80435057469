"""Beside the paper: whether a number agrees, which reasons are told, and in which order."""

import dataclasses

import pytest
from result_samples import PAPER, paper_figure

from ajgdata.report.comparison import (
    Change,
    Mark,
    PaperComparison,
    Reason,
    evidence,
    holds,
    in_papers_order,
    mark_of,
)
from ajgdata.report.format import Score


@pytest.mark.parametrize(
    ("gap", "sd", "verdict"),
    [(1.0, 0.4, "agrees"), (1.0, 0.6, "inconclusive"), (-1.0, 0.4, "disagrees"),
     (1.0, float("nan"), "inconclusive")],
)  # fmt: skip
def test_a_statement_holds_beyond_two_standard_deviations(gap, sd, verdict):
    assert holds(Score(gap, sd)) == verdict


LOW = (mark_of("ours", Score(1.0, 0.1)),)


def reason(before: float, after: float, *, supported: bool = True) -> Reason:
    test = Change("twice the scatter", "CNN", before, after, supported)
    return Reason(("size",), "the scatter sets the error", "ablations.html#x", (test,))


def row(agrees: str, paper=PAPER, dataset="size", **changes) -> PaperComparison:
    given = PaperComparison(paper, dataset, "edge", "simulated", "1 mm", "CNN", agrees, marks=LOW)
    return dataclasses.replace(given, **changes)


def test_reasons_must_be_supported_and_point_to_the_paper():
    up, down, vague = reason(1.0, 2.0), reason(1.0, 0.5), reason(1.0, 2.1, supported=False)
    reasons = (up, down, vague)
    high = (Mark("ours", 9.0, 8.0, 10.0),)  # the paper: 2.6 mm
    for agrees, marks, why in (
        ("better", LOW, [up]), ("worse", high, [down]), ("inconclusive", LOW, [up]),
        ("inconclusive", high, [down]),
    ):  # fmt: skip
        one = row(agrees, reasons=reasons, marks=marks)
        assert (one.differs, one.why) == (True, why)
    assert not row("agrees", reasons=reasons).differs
    assert row("worse").differs and not row("inconclusive").differs  # no reason was tested
    assert evidence(up) == "twice the scatter (CNN 1 → 2)"
    assert evidence(vague).endswith("within the spread of folds)")


def test_rows_stand_in_the_paper_s_order_one_a_figure_and_data_set():
    first, second = paper_figure("a", 1.0), paper_figure("b", 2.0)
    given = ((second, "size"), (first, "d"), (first, "d"), (first, "e"))
    verdicts = ("agrees", "agrees", "worse", "agrees")
    rows = [row(verdict, *one) for verdict, one in zip(verdicts, given, strict=True)]
    ordered = in_papers_order(rows, (first, second))
    assert [(r.paper.id, r.dataset, r.agrees) for r in ordered] == [
        ("a", "d", "agrees"), ("a", "e", "agrees"), ("b", "size", "agrees"),
    ]  # fmt: skip
