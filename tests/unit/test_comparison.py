"""Beside the paper: whether a number agrees, which reasons are told, and in which order."""

import dataclasses

import pytest
from result_samples import PAPER, paper_figure

from ajgdata.report.comparison import (
    HIGHER,
    LOWER,
    VAGUE,
    YES,
    Change,
    PaperComparison,
    Reason,
    agreement,
    evidence,
    in_papers_order,
)
from ajgdata.report.format import Score


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


def test_more_than_a_bound_agrees_and_one_fold_has_no_spread():
    assert agreement(Score(90.0, 1.0), 80, at_least=True) == YES
    assert agreement(Score(70.0, 1.0), 80, at_least=True) == LOWER
    assert agreement(Score(1.0, float("nan")), 1.01) == LOWER


def reason(before: float, after: float, *, supported: bool = True) -> Reason:
    test = Change("twice the scatter", "CNN", before, after, supported)
    return Reason(("size",), "the scatter sets the error", "ablations.html#x", (test,))


def row(agrees: str, paper=PAPER, dataset="size", **changes) -> PaperComparison:
    given = PaperComparison(paper, dataset, "edge", "simulated", "1 mm", "CNN", agrees)
    return dataclasses.replace(given, **changes)


def test_reasons_must_be_supported_and_point_to_the_paper():
    up, down, vague = reason(1.0, 2.0), reason(1.0, 0.5), reason(1.0, 2.1, supported=False)
    reasons = (up, down, vague)
    for agrees, why in ((LOWER, [up]), (HIGHER, [down]), (VAGUE[False], [up]), (VAGUE[1], [down])):
        one = row(agrees, reasons=reasons)
        assert (one.differs, one.why) == (True, why)
    assert not row(YES, reasons=reasons).differs
    assert evidence(up) == "twice the scatter (CNN 1 → 2)"
    assert evidence(vague).endswith("within the spread of folds)")


def test_rows_of_two_splits_both_stand_beside_one_figure():
    first = paper_figure("a", 1.0)
    splits = ["by grasp", "by recording"]
    rows = [dataclasses.replace(row(YES, first, "d"), split=split) for split in splits]
    assert [r.split for r in in_papers_order([*rows, *rows], (first,))] == splits


def test_rows_stand_in_the_paper_s_order_one_a_figure_and_data_set():
    first, second = paper_figure("a", 1.0), paper_figure("b", 2.0)
    rows = [row(YES, second), row(YES, first, "d"), row(LOWER, first, "d"), row(YES, first, "e")]
    ordered = in_papers_order(rows, (first, second))
    assert [(r.paper.id, r.dataset, r.agrees) for r in ordered] == [
        ("a", "d", YES), ("a", "e", YES), ("b", "size", YES),
    ]  # fmt: skip
