"""Beside the paper: whether a number agrees, which reasons are told, and in which order."""

import dataclasses
from pathlib import Path

import pytest
from result_samples import PAPER, paper_figure

from ajgdata.evaluate.agreement import PAPER_VERDICTS, VERDICT_MEANINGS, Estimate, Interval
from ajgdata.report.answer import VERDICT_TEXTS
from ajgdata.report.comparison import (
    SIGNS,
    UNSTABLE,
    Change,
    Judgement,
    Mark,
    PaperComparison,
    PaperFigure,
    Reason,
    evidence,
    holds,
    in_papers_order,
    judged,
    mark_of,
    parse_paper,
)
from ajgdata.report.format import Score


@pytest.mark.parametrize(
    ("gap", "sd", "verdict"),
    [
        (1.0, 0.4, "agrees"),
        (1.0, 0.6, "inconclusive"),
        (-1.0, 0.4, "disagrees"),
        (1.0, float("nan"), "inconclusive"),
    ],
)
def test_a_statement_holds_beyond_two_standard_deviations(gap, sd, verdict):
    assert holds(Score(gap, sd)) == verdict


@pytest.mark.parametrize(
    ("interval", "spread", "verdict", "remark"),
    [
        ((2.7, 3.3), 0.0, "worse", ""),
        ((2.7, 3.3), 0.09, "worse", ""),
        ((2.7, 3.3), 0.2, "inconclusive", UNSTABLE),  # 2.5 to 3.1 contains 2.6
        ((1.9, 2.5), 0.2, "inconclusive", UNSTABLE),
        ((1.9, 2.5), 0.09, "better", ""),
        ((2.5, 3.1), 0.09, "agrees", ""),
        ((2.5, 3.1), 0.2, "inconclusive", UNSTABLE),
        ((1.0, 4.0), 0.2, "inconclusive", ""),  # too wide on every machine
    ],
)
def test_a_verdict_that_another_machine_would_change_is_inconclusive(
    interval, spread, verdict, remark
):
    paper = paper_figure("size", 2.6, spread=spread)
    score = Estimate(sum(interval) / 2, Interval(*interval), chance=8.0, perfect=0.0)
    assert judged(paper, score, 2.6) == (verdict, remark)


@pytest.mark.parametrize(("spread", "verdict"), [(0.9, "worse"), (1.1, "inconclusive")])
def test_the_difference_between_machines_is_in_the_unit_of_the_paper(spread, verdict):
    paper = paper_figure("ycb", 85.6, unit="%", spread=spread)
    score = Estimate(0.8, Interval(0.76, 0.846), chance=0.06, perfect=1.0)
    assert judged(paper, score, 0.856, scale=100).verdict == verdict


def accuracy_of(value: float, **changes) -> PaperFigure:
    return paper_figure("a", value, metric="accuracy", unit="%", **changes)


def judged_accuracy(paper: PaperFigure, share: float, interval: Interval) -> Judgement:
    score = Estimate(share, interval, chance=0.25, perfect=1.0)
    return judged(paper, score, paper.value / 100, scale=100.0)


def test_a_published_accuracy_has_the_uncertainty_of_its_grasps():
    """Ours is 80 % (77 to 83), the published value 90 %. The binomial standard error of 90 % is
    4.7, 3.4 and 2.4 % of 40, 80 and 160 grasps, so 10 % are more than two of the last two."""
    result = judged_accuracy(accuracy_of(90.0), 0.80, Interval(0.77, 0.83))
    assert result.verdict == "inconclusive"
    reason = "n of the paper is not stated: inconclusive at 40, worse at 80 and 160"
    assert result.remark == reason


def test_a_stated_number_of_grasps_decides():
    for n, verdict in ((40, "inconclusive"), (320, "worse")):
        result = judged_accuracy(accuracy_of(90.0, n=n), 0.80, Interval(0.77, 0.83))
        assert (result.verdict, result.remark) == (verdict, f"n of the paper: {n}")


def test_a_verdict_that_is_equal_for_all_numbers_of_grasps_counts():
    for share, verdict in ((0.40, "worse"), (0.975, "agrees")):
        interval = Interval(share - 0.02, share + 0.02)
        result = judged_accuracy(accuracy_of(98.0), share, interval)
        assert result.verdict == verdict
        assert result.remark.endswith(f"{verdict} at 40, 80 and 160")
    unstable = judged_accuracy(accuracy_of(90.0, n=320, spread=9.0), 0.80, Interval(0.77, 0.83))
    assert unstable.verdict == "inconclusive" and unstable.remark.endswith(UNSTABLE)


def test_only_accuracies_have_a_binomial_interval():
    assert paper_figure("size", 2.6).intervals == {}
    assert accuracy_of(100.0, n=16).intervals[16].high == pytest.approx(100.0)
    # Wilson: of n correct of n, the low end is n / (n + 1.96²).
    assert accuracy_of(100.0, n=16).intervals[16].low == pytest.approx(
        100 * 16 / (16 + 1.959964**2)
    )


def test_each_verdict_has_a_sign_a_meaning_a_sentence_and_a_row_in_the_documentation():
    root = Path(__file__).resolve().parents[2]
    page = (root / "docs/variants.md").read_text(encoding="utf-8")
    assert PAPER_VERDICTS == tuple(VERDICT_MEANINGS) == tuple(SIGNS)
    assert set(VERDICT_TEXTS) == set(PAPER_VERDICTS)
    for verdict, meaning in VERDICT_MEANINGS.items():
        assert f"\n| {verdict} | {meaning} |\n" in page


def test_the_difference_between_machines_belongs_to_a_published_value():
    figures = [PAPER.model_dump() | {"id": name} for name in ("a", "b")]
    content = {"source": "S", "title": "T", "authors": "A", "url": "U", "figures": figures}
    known = parse_paper(content, spread={"b": 0.25})
    assert {name: figure.spread for name, figure in known.items()} == {"a": 0.0, "b": 0.25}


LOW = (mark_of("ours", Score(1.0, 0.1)),)


def reason(before: float, after: float, *, supported: bool = True) -> Reason:
    test = Change("twice the scatter", "CNN", before, after, supported)
    return Reason(("size",), "the scatter sets the error", "causes.html#x", (test,))


def row(agrees: str, paper=PAPER, dataset="size", **changes) -> PaperComparison:
    given = PaperComparison(paper, dataset, "edge", "simulated", "1 mm", "CNN", agrees, marks=LOW)
    return dataclasses.replace(given, **changes)


def test_reasons_must_be_supported_and_point_to_the_paper():
    up = reason(1.0, 2.0)
    down = reason(1.0, 0.5)
    vague = reason(1.0, 2.1, supported=False)
    reasons = (up, down, vague)
    high = (Mark("ours", 9.0, 8.0, 10.0),)  # the paper: 2.6 mm
    for agrees, marks, why in (
        ("better", LOW, [up]),
        ("worse", high, [down]),
        ("inconclusive", LOW, [up]),
        ("inconclusive", high, [down]),
    ):
        entry = row(agrees, reasons=reasons, marks=marks)
        assert (entry.differs, entry.why) == (True, why)
    assert not row("agrees", reasons=reasons).differs
    assert row("worse").differs and not row("inconclusive").differs  # no reason was tested
    assert evidence(up) == "twice the scatter (CNN 1 → 2)"
    assert evidence(vague).endswith("2.1 not supported)")


def test_a_reason_can_be_about_one_split():
    about_all = reason(1.0, 2.0)
    about_one = dataclasses.replace(about_all, split="random split")
    grouped, random = (row("worse", split=f"{name} split") for name in ("grouped", "random"))
    assert about_all.is_about(grouped) and about_all.is_about(random)
    assert about_one.is_about(random) and not about_one.is_about(grouped)


def test_rows_stand_in_the_paper_s_order_one_a_figure_and_data_set():
    first = paper_figure("a", 1.0)
    second = paper_figure("b", 2.0)
    given = ((second, "size"), (first, "d"), (first, "d"), (first, "e"))
    verdicts = ("agrees", "agrees", "worse", "agrees")
    rows = [row(verdict, *pair) for verdict, pair in zip(verdicts, given, strict=True)]
    ordered = in_papers_order(rows, (first, second))
    assert [(r.paper.id, r.dataset, r.agrees) for r in ordered] == [
        ("a", "d", "agrees"),
        ("a", "e", "agrees"),
        ("b", "size", "agrees"),
    ]
