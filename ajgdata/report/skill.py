"""Figure of the first screen: our results, the best other model and the published values on one
axis, on which 0 is chance and 1 is perfect."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from ajgdata.report.blocks import Illustration
from ajgdata.report.comparison import Mark, PaperComparison, Role
from ajgdata.report.format import Score, words
from ajgdata.report.marks import Picture, Point, illustration
from ajgdata.report.page import SKILL

SERIES: dict[Role, str] = {"ours": "ours", "baseline": "best other model", "paper": "paper"}
PER_CENT = 100.0


def skill_figure(comparisons: Sequence[PaperComparison]) -> Illustration | None:
    """Return the figure, None if no result has both a number and a chance level."""
    points = [point for row in comparisons for point in _points(row)]
    if not points:
        return None
    order = [name for name in SERIES.values() if any(p.series == name for p in points)]
    picture = Picture(
        title="Our results and the published ones, between chance (0) and perfect (1)",
        subtitle="bars: 95 % interval over grasps",
        sources=tuple(dict.fromkeys(row.source for row in comparisons)),
        points=tuple(sorted(points, key=lambda point: order.index(point.series))),
        axis=("skill: 0 chance, 1 perfect", ""),
        chance=(("", 0.0),),
    )
    text = "Skill: (value - chance) / (perfect - chance). Perfect is an error of 0 or an accuracy "
    text += "of 100 %. The paper's values were measured on a real gripper."
    return illustration(SKILL, "rows", picture, text)


def label_of(row: PaperComparison) -> str:
    """Return the name of a row: the experiment, and what tells rows of one experiment apart."""
    part = row.label or row.paper.row
    return ", ".join(filter(None, (row.paper.panel or words(row.paper.where), part)))


def _points(row: PaperComparison) -> Iterator[Point]:
    marks = {mark.role: mark for mark in row.marks}
    chance = marks.get("chance")
    if chance is None or "ours" not in marks:
        return
    if row.paper.value is not None:
        value = row.paper.value
        marks["paper"] = Mark("paper", value, value, value)
    perfect = PER_CENT if row.unit == "%" else 0.0

    def skill(value: float) -> float:
        return (value - chance.value) / (perfect - chance.value)

    for role, series in SERIES.items():
        if (mark := marks.get(role)) and math.isfinite(mark.value):
            low, high = sorted((skill(mark.low), skill(mark.high)))
            yield Point("", series, label_of(row), Score(skill(mark.value), 0.0, (), low, high))
