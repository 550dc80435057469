"""Sentences on results: at the end of a run, and at the head of its report and of each page."""

from __future__ import annotations

from ajgdata.evaluate.agreement import PaperVerdict
from ajgdata.report.comparison import PaperComparison, Role
from ajgdata.report.format import number, with_unit
from ajgdata.report.report_data import Report, ResultRow, TaskSection

#: Ids of the published values in the first sentences: objects, size and angle.
FIRST_RESULTS = ("ycb", "size-known", "orientation")
MAX_SENTENCES = 3
REFERENCE_ROLES: tuple[Role, Role] = ("placebo", "chance")
VERDICT_TEXTS: dict[PaperVerdict, str] = {
    "agrees": "Our result agrees.",
    "partly agrees": "Our result partly agrees.",
    "better": "Our result is better.",
    "worse": "Our result is worse.",
    "inconclusive": "The comparison is inconclusive.",
    "disagrees": "Our result disagrees.",
}


def answer(report: Report) -> list[str]:
    """Return our results with the published values, else the best model of each task."""
    rows = {row.paper.id: row for row in reversed(report.comparisons)}
    order = dict.fromkeys([*FIRST_RESULTS, *(row.paper.id for row in report.comparisons)])
    compared = [compared_sentence(rows[id_]) for id_ in order if id_ in rows]
    best = [best_sentence(s, row) for s in report.sections for row in s.rows if row.answer]
    sentences = [sentence for sentence in compared if sentence] or best
    return sentences[:MAX_SENTENCES]


def compared_sentence(row: PaperComparison) -> str:
    """Return a result with chance level, published value, verdict and cause; "" without numbers."""
    marks = {mark.role: mark for mark in row.marks}
    if not {"ours", "chance"} <= marks.keys() or row.paper.value is None:
        return ""
    ours = marks["ours"]
    value = number(ours.value)
    low = number(ours.low)
    high = number(ours.high)
    chance = with_unit(number(marks["chance"].value), row.unit)
    published = with_unit(number(row.paper.value), row.paper.unit)
    result = f"{row.paper.metric.replace('rmse', 'RMSE')} {with_unit(value, row.unit)}"
    return (
        f"{row.name} ({row.model}, {row.source}): {result} (95 % interval {low} to {high}, chance "
        f"level {chance}){controls_clause(row.controls)}; the paper reports {published}."
        f" {VERDICT_TEXTS[row.agrees]}{cause(row)}"
    )


def controls_clause(controls: str) -> str:
    """Return the result with held-out sessions and the placebo after a comma; "" without them."""
    return f", {controls.replace('; ', ', ')}" if controls else ""


def placebo_sentence(report: Report) -> str:
    """Return the placebo of each result that has one; "" without any."""
    texts = []
    for row in report.comparisons:
        marks = {mark.role: mark for mark in row.marks}
        if "placebo" in marks and "chance" in marks:
            value, chance = (
                with_unit(number(marks[role].value), row.unit) for role in REFERENCE_ROLES
            )
            texts.append(f"{row.name} {value} (chance level {chance})")
    return f"Placebo, one object under several names: {'; '.join(texts)}." if texts else ""


def cause(row: PaperComparison) -> str:
    """Return a sentence on the supported cause of a difference; "" if no cause was tested."""
    if not row.differs or not row.reasons:
        return ""
    if not row.why:
        return " No tested cause is supported."
    return f" Supported cause: {row.why[0].claim}."


def best_sentence(section: TaskSection, row: ResultRow) -> str:
    """Return the result of the best model of a task with its chance level."""
    about = f"{section.title} (best model {row.label}, {section.source})"
    return (
        f"{about}: {row.metric} {row.answer}, chance level {row.chance}"
        f"{controls_clause(row.controls)}."
    )
