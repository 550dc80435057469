"""Page of the comparison with the paper: results with verdict, cause and cost, and the rules."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from ajgdata.evaluate.agreement import VERDICT_MEANINGS
from ajgdata.report.comparison import ASSUMED_N, SIGNS, PaperComparison, PaperFigure, Reason
from ajgdata.report.format import DASH, Source, enumerated, number
from ajgdata.report.report_data import Report


class CauseCell(NamedTuple):
    """Cell on the causes of a difference: supported causes, and a text on other causes."""

    supported: list[Reason]
    untested: str
    unsupported: str


class PaperRow(NamedTuple):
    """A row of the comparison: a published value, our result, verdict, causes, model and cost."""

    css: str
    name: str
    link: str
    verdict: str
    remark: str
    paper: PaperFigure
    result: str
    source: Source
    causes: CauseCell | None
    model: str
    train_cpu_s: str
    prediction_ms: str


@dataclass(frozen=True)
class PaperView:
    """Values of the template of the comparison with the paper."""

    tally: str
    rows: list[PaperRow]
    has_causes: bool
    verdict_meanings: list[tuple[str, str]]
    assumed_n: str
    absent: str


def paper_view(report: Report) -> PaperView:
    """Return the values of the page; the table has causes only if a cause was tested."""
    meanings = [(verdict.capitalize(), meaning) for verdict, meaning in VERDICT_MEANINGS.items()]
    absent = dict.fromkeys(figure.name for figure in report.absent)
    return PaperView(
        tally=report.tally,
        rows=[_row(row) for row in report.comparisons],
        has_causes=any(row.reasons for row in report.comparisons),
        verdict_meanings=meanings,
        assumed_n=enumerated([str(n) for n in ASSUMED_N]),
        absent="; ".join(absent),
    )


def _row(row: PaperComparison) -> PaperRow:
    return PaperRow(
        css=row.agrees.replace(" ", "-"),
        name=row.name,
        link=row.page,
        verdict=f"{SIGNS[row.agrees]} {row.agrees}",
        remark=row.remark,
        paper=row.paper,
        result=row.result,
        source=row.source,
        causes=_cause_cell(row) if row.differs else None,
        model=row.model or DASH,
        train_cpu_s=number(row.cost.train_cpu_s) if row.cost else DASH,
        prediction_ms=number(row.cost.prediction_ms) if row.cost else DASH,
    )


def _cause_cell(row: PaperComparison) -> CauseCell:
    supported = row.why
    n_unsupported = len(row.reasons) - len(supported)
    text = f"Not supported: {n_unsupported} of {len(row.reasons)} tested causes."
    return CauseCell(
        supported=supported,
        untested="" if row.reasons else "not tested",
        unsupported=text if n_unsupported else "",
    )
