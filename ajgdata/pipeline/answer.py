"""Up to three sentences on the results of a run, for the end of its console output."""

from __future__ import annotations

from ajgdata.report.comparison import PaperComparison
from ajgdata.report.format import number, with_unit
from ajgdata.report.report_data import Report, ResultRow, TaskSection

#: Published values of the first sentences: objects, size and angle.
FIRST = ("ycb", "size-known", "orientation")
MOST = 3  #: sentences


def answer(report: Report) -> list[str]:
    """Return our results with the published values, else the best model of each task."""
    rows = {row.paper.id: row for row in reversed(report.comparisons)}
    order = dict.fromkeys([*FIRST, *(row.paper.id for row in report.comparisons)])
    compared = [*filter(None, (_compared(rows[name]) for name in order if name in rows))]
    best = [_best(section, row) for section, row in report.answers]
    return (compared or best)[:MOST]


def _compared(row: PaperComparison) -> str:
    """Return a result with chance, the published value and the verdict, "" if one has no number."""
    marks = {mark.role: mark for mark in row.marks}
    if not {"ours", "chance"} <= marks.keys() or row.paper.value is None:
        return ""
    value, low, high = (number(one, 2) for one in marks["ours"][1:])
    chance = with_unit(number(marks["chance"].value, 2), row.unit)
    published = with_unit(number(row.paper.value), row.paper.unit)
    about = f"{row.paper.panel or row.paper.where} ({row.model}, {row.source})"
    result = f"{row.paper.metric.replace('rmse', 'RMSE')} {with_unit(value, row.unit)}"
    return (
        f"{about}: {result} ({low} to {high}), chance level {chance}, "
        f"published {published}: {row.agrees}."
    )


def _best(section: TaskSection, row: ResultRow) -> str:
    about = f"{section.title} (best model {row.label}, {section.source})"
    return f"{about}: {row.metric} {row.answer}, chance level {row.chance}."
