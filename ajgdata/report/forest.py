"""Forest plot: results on a skill axis, on which 0 is the chance level and 1 is perfect.

A page shows it as a table with one row per result. Marks are placed in per cent of the axis.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ajgdata.evaluate.agreement import PaperVerdict
from ajgdata.report.comparison import SIGNS, Mark, PaperComparison, Role
from ajgdata.report.format import NO_BREAK, Source, number, with_unit
from ajgdata.report.navigation import experiment_link
from ajgdata.report.report_data import TaskSection

#: Ends of the axis; marks below it are drawn as an arrow at its left end.
AXIS_START = -0.5
AXIS_END = 1.0
PERFECT_PER_CENT = 100.0
#: Meaning of each mark, for the legend and for people who cannot see it.
MARK_NAMES: dict[Role, str] = {
    "ours": "our result",
    "paper": "published value",
    "sessions": "our result in held-out sessions",
    "baseline": "best other model",
    "placebo": "placebo: one object under several names",
}
#: Marks that share a line of a row, from the top. No mark hides a mark of another line.
LINES: tuple[tuple[Role, ...], ...] = (
    ("ours", "paper"),
    ("sessions",),
    ("baseline",),
    ("placebo",),
)
#: Height of a line of marks (CSS pixels).
LINE_PX = 11


class MarkPosition(NamedTuple):
    """A mark on the axis: its place and the ends of its interval, in per cent of the width."""

    role: Role
    at: float
    low: float
    high: float
    is_below: bool  #: the value is below the lowest value of the axis
    line: int  #: from the top of the row

    @property
    def bar_width(self) -> float:
        """Return the width of the interval in per cent; 0 without an interval."""
        return round(self.high - self.low, 2)

    @property
    def middle_px(self) -> float:
        """Return the distance of its middle from the top of the row, in CSS pixels."""
        return LINE_PX * (self.line + 0.5)

    @property
    def css(self) -> str:
        """Return the classes of the mark in the style sheet."""
        return f"{self.role} below" if self.is_below else self.role


class ForestRow(NamedTuple):
    """A result: name, marks, two texts (published value or chance level, and our value).

    `badge` is the source of the recordings if the report has both sources, else "". `controls` are
    the values in held-out sessions and of the placebo, in words.
    """

    name: str
    link: str
    badge: Source | str
    positions: tuple[MarkPosition, ...]
    reference: str
    result: str
    details: str
    verdict: PaperVerdict | None = None
    alt: str = ""
    controls: str = ""

    @property
    def css(self) -> str:
        """Return the class of the row in the style sheet; "" without a verdict."""
        return self.verdict.replace(" ", "-") if self.verdict else ""

    @property
    def height_px(self) -> int:
        """Return the height of the lines of marks, in CSS pixels."""
        return LINE_PX * (1 + max((mark.line for mark in self.positions), default=0))

    @property
    def verdict_text(self) -> str:
        """Return the verdict with its sign; "" without a verdict."""
        return f"{SIGNS[self.verdict]} {self.verdict}" if self.verdict else ""


class Tick(NamedTuple):
    """A tick of the axis: its place in per cent of the width, and its label."""

    at: float
    label: str


class LegendEntry(NamedTuple):
    """A mark of the legend: its classes in the style sheet, and its meaning."""

    css: str
    text: str


class ForestTable(NamedTuple):
    """A forest plot: rows, ticks, and titles of the columns with the reference and our result."""

    rows: list[ForestRow]
    reference: str
    result: str
    has_verdicts: bool
    ticks: tuple[Tick, ...]

    @property
    def legend(self) -> list[LegendEntry]:
        """Return the marks that the rows contain, with their meaning."""
        marks = [mark for row in self.rows for mark in row.positions]
        drawn = {mark.role for mark in marks}
        names = dict(MARK_NAMES)
        names["ours"] += " with its 95 % interval" if self.has_verdicts else " ± sd over folds"
        entries = [LegendEntry(role, text) for role, text in names.items() if role in drawn]
        if any(mark.is_below for mark in marks):
            entries.append(LegendEntry("ours below", "further left than the axis shows"))
        return entries

    @property
    def reference_label(self) -> str:
        """Return the title of the reference in front of a value on narrow screens."""
        return self.reference.lower()


def place(value: float) -> float:
    """Return the place of a skill, in per cent of the axis from its left end."""
    inside = min(max(value, AXIS_START), AXIS_END)
    return round(100 * (inside - AXIS_START) / (AXIS_END - AXIS_START), 2)


TICKS = (Tick(place(0.0), "guessing"), Tick(place(0.5), "half way"), Tick(place(1.0), "perfect"))


def paper_forest(
    comparisons: Sequence[PaperComparison], *, with_badges: bool, result: str = "Our result"
) -> ForestTable | None:
    """Return the forest plot of results of the paper; None if there are none.

    `result` is the title of our results. `with_badges` adds the source of the recordings.
    """
    rows = paper_rows(comparisons, with_badges=with_badges)
    if not rows:
        return None
    return ForestTable(rows, "Published", result, True, TICKS)


def model_forest(sections: Sequence[TaskSection], *, with_badges: bool) -> ForestTable | None:
    """Return the forest plot of tasks and models; None if no model has marks."""
    rows = model_rows(sections, with_badges=with_badges)
    if not rows:
        return None
    return ForestTable(rows, "Chance level", "Held-out groups, mean ± sd over folds", False, TICKS)


def paper_rows(comparisons: Sequence[PaperComparison], *, with_badges: bool) -> list[ForestRow]:
    """Return one row per result of the paper."""
    rows = []
    for row in comparisons:
        marks = {mark.role: mark for mark in row.marks}
        published = row.paper.value
        if published is not None:
            marks["paper"] = Mark("paper", published, published, published)
        positions, alt = _placed(marks, row.unit)
        rows.append(
            ForestRow(
                name=row.name,
                link=row.page,
                badge=row.source if with_badges else "",
                positions=positions,
                reference=row.paper.published,
                result=row.short_result,
                details=f"{row.result}; {row.remark}" if row.remark else row.result,
                verdict=row.agrees,
                alt=alt,
                controls=controls_text(marks, row.unit),
            )
        )
    return rows


def model_rows(sections: Sequence[TaskSection], *, with_badges: bool) -> list[ForestRow]:
    """Return one row per task and model that has marks."""
    rows = []
    for section in sections:
        for row in section.rows:
            if not row.marks:
                continue
            marks = {mark.role: mark for mark in row.marks}
            positions, alt = _placed(marks, row.unit)
            rows.append(
                ForestRow(
                    name=f"{section.title}: {row.label}",
                    link=experiment_link(section.parts[0].page),
                    badge=section.source if with_badges else "",
                    positions=positions,
                    reference=row.chance,
                    result=row.value,
                    details=row.metric,
                    alt=alt,
                    controls=controls_text(marks, row.unit),
                )
            )
    return rows


def controls_text(marks: Mapping[Role, Mark], unit: str) -> str:
    """Return the values in held-out sessions and of the placebo; "" without both.

    A no-break space keeps a value and its unit in one line.

    >>> from ajgdata.report.comparison import Mark
    >>> controls_text({"sessions": Mark("sessions", 61.94, 50, 70)}, "%")
    'held-out sessions 61.9\\xa0%'
    """
    names: dict[Role, str] = {"sessions": "held-out sessions", "placebo": "placebo"}
    return ", ".join(
        f"{name} {with_unit(number(marks[role].value), unit).replace(' ', NO_BREAK)}"
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


def _placed(marks: Mapping[Role, Mark], unit: str) -> tuple[tuple[MarkPosition, ...], str]:
    """Return the marks on the axis and their skills in words; no marks without a chance level."""
    chance = marks.get("chance")
    if chance is None or "ours" not in marks:
        return (), "no mark: the result is not a number that a guess also has"
    positions = []
    listed = []
    line = 0
    for roles in LINES:
        drawn = [marks[role] for role in roles if role in marks]
        finite = [mark for mark in drawn if math.isfinite(mark.value)]
        for mark in finite:
            value = skill(mark.value, chance.value, unit)
            ends = skill(mark.low, chance.value, unit), skill(mark.high, chance.value, unit)
            low = place(min(ends))
            high = place(max(ends))
            is_below = value < AXIS_START
            positions.append(MarkPosition(mark.role, place(value), low, high, is_below, line))
            listed.append(f"{MARK_NAMES[mark.role]} {number(value, 2)}")
        if finite:
            line += 1
    return tuple(positions), f"0 is guessing, 1 is perfect: {', '.join(listed)}"
