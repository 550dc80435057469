"""Forest plot: results on a skill axis, on which 0 is the chance level and 1 is perfect.

A page shows it as a table with one row per result. Marks are placed in per cent of the axis.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ajgdata.evaluate.agreement import PaperVerdict
from ajgdata.report.comparison import Mark, PaperComparison, Role
from ajgdata.report.format import Source, number, with_unit
from ajgdata.report.navigation import experiment_link
from ajgdata.report.report_data import TaskSection

#: Ends of the axis; marks below it are drawn as an arrow at its left end.
AXIS_START, AXIS_END = -0.5, 1.0
PERFECT_PER_CENT = 100.0
#: What each mark is, for the legend and for people who cannot see it.
MARK_NAMES: dict[Role, str] = {
    "paper": "published value",
    "baseline": "best other model",
    "sessions": "our result in held-out sessions",
    "placebo": "placebo: one object under several names",
    "ours": "our result",
}
#: Ticks of the axis, with their labels.
TICKS = ((0.0, "0 chance"), (0.5, "0.5"), (1.0, "1 perfect"))


class MarkPosition(NamedTuple):
    """A mark on the axis: its place and the ends of its interval, in per cent of the width."""

    role: Role
    at: float
    low: float
    high: float
    is_below: bool  #: the value is below the lowest value of the axis


class ForestRow(NamedTuple):
    """A result: name, marks, two texts (published value or chance level, and our value).

    `controls` are the values with held-out sessions and of the placebo, in words.
    """

    name: str
    link: str
    source: Source
    positions: tuple[MarkPosition, ...]
    reference: str
    result: str
    details: str
    verdict: PaperVerdict | None = None
    alt: str = ""
    controls: str = ""


def paper_rows(comparisons: Sequence[PaperComparison]) -> list[ForestRow]:
    """Return one row per result of the paper."""
    rows = []
    for row in comparisons:
        marks = {mark.role: mark for mark in row.marks}
        if row.paper.value is not None:
            marks["paper"] = Mark("paper", *[row.paper.value] * 3)
        positions, alt = _placed(marks, row.unit)
        details = f"{row.result}; {row.remark}" if row.remark else row.result
        texts = row.paper.published, row.short_result, details
        rows.append(
            ForestRow(
                row.name,
                row.page,
                row.source,
                positions,
                *texts,
                row.agrees,
                alt,
                controls_text(marks, row.unit),
            )
        )
    return rows


def model_rows(sections: Sequence[TaskSection]) -> list[ForestRow]:
    """Return one row per task and model."""
    rows = []
    for section in sections:
        for row in (row for row in section.rows if row.marks):
            marks = {mark.role: mark for mark in row.marks}
            positions, alt = _placed(marks, row.unit)
            name, texts = f"{section.title}: {row.label}", (row.chance, row.value, row.metric)
            link = experiment_link(section.parts[0].page)
            rows.append(
                ForestRow(
                    name,
                    link,
                    section.source,
                    positions,
                    *texts,
                    None,
                    alt,
                    controls_text(marks, row.unit),
                )
            )
    return rows


def controls_text(marks: Mapping[Role, Mark], unit: str) -> str:
    """Return the values with held-out sessions and of the placebo; "" without.

    >>> from ajgdata.report.comparison import Mark
    >>> controls_text({"sessions": Mark("sessions", 61.94, 50, 70)}, "%")
    'held-out sessions 61.9 %'
    """
    names: dict[Role, str] = {"sessions": "held-out sessions", "placebo": "placebo"}
    return ", ".join(
        f"{name} {with_unit(number(marks[role].value), unit)}"
        for role, name in names.items()
        if role in marks
    )


def skill(value: float, chance: float, unit: str) -> float:
    """Return the skill (value - chance) / (perfect - chance); perfect is 100 %, or an error of 0.

    >>> from ajgdata.report.forest import skill
    >>> skill(2.0, chance=8.0, unit="mm"), skill(62.5, chance=25.0, unit="%")
    (0.75, 0.5)
    """
    perfect = PERFECT_PER_CENT if unit == "%" else 0.0
    return (value - chance) / (perfect - chance)


def place(value: float) -> float:
    """Return where a skill is drawn, in per cent of the axis from its left end."""
    inside = min(max(value, AXIS_START), AXIS_END)
    return round(100 * (inside - AXIS_START) / (AXIS_END - AXIS_START), 2)


def _placed(marks: Mapping[Role, Mark], unit: str) -> tuple[tuple[MarkPosition, ...], str]:
    """Return the marks on the axis and their skills in words; none without a chance level."""
    chance = marks.get("chance")
    if chance is None or "ours" not in marks:
        return (), "no skill: the result is not a number with a chance level"
    positions, listed = [], []
    for role, name in MARK_NAMES.items():
        mark = marks.get(role)
        if mark is None or not math.isfinite(mark.value):
            continue
        value, *ends = (skill(end, chance.value, unit) for end in mark[1:])
        low, high = place(min(ends)), place(max(ends))
        positions.append(MarkPosition(role, place(value), low, high, value < AXIS_START))
        listed.append(f"{name} {number(value, 2)}")
    return tuple(positions), f"skill: {', '.join(listed)}"
