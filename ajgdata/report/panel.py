"""Small multiples of the first screen: a result beside the paper's, told by position and by mark.

A panel is a link to the page on which all is told. Its rows share one scale, so that what lies
further right is more; positions are shares of that scale, which a page sets in per cent.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

from ajgdata.evaluate.agreement import Verdict
from ajgdata.report.comparison import Mark, PaperComparison, tally, tally_text
from ajgdata.report.format import Score, Source, mean_sd, number, with_unit, words
from ajgdata.report.paper import PaperFigure

#: `mixed`: rows of a panel with different verdicts.
Stance = Verdict | Literal["mixed", "absent"]
#: Sign and word of each stance: never colour alone.
SIGNS: dict[Stance, tuple[str, str]] = {
    "agrees": ("✓", "agrees"),
    "partly agrees": ("◐", "partly agrees"),
    "better": ("▲", "better"),
    "worse": ("▼", "worse"),
    "inconclusive": ("?", "inconclusive"),
    "disagrees": ("≠", "disagrees"),
    "mixed": ("◐", "mixed"),
    "absent": ("–", "not in this run"),
}
#: Room beyond the largest value, as a share of the scale.
ROOM = 0.06
PER_CENT = 100.0


class Highlight(NamedTuple):
    """One finding that the paper does not have: `said` in a few words, and what is drawn of it."""

    title: str
    said: str
    unit: str
    marks: tuple[Mark, ...]


class Placed(NamedTuple):
    """A mark on the scale: place and ends of its interval in per cent, and its words."""

    mark: Mark
    at: float
    start: float
    width: float
    words: str


@dataclass(frozen=True)
class PanelRow:
    """One line of a panel: what is compared, and `said` of the paper (or of what was expected)."""

    label: str
    ours: str
    paper: str
    marks: tuple[Mark, ...]
    verdict: Verdict | Literal[""] = ""
    unit: str = ""


@dataclass(frozen=True)
class Panel:
    """One small multiple; without a stance it is about something that the paper does not have."""

    title: str
    link: str
    source: Source | None
    rows: tuple[PanelRow, ...]
    stance: Stance | None = None
    said: str = ""
    verdict: str = ""  #: counts of the verdicts of its rows, or the only verdict

    @property
    def tall(self) -> bool:
        """Return whether it takes the room of two."""
        return len(self.rows) > 1

    def span(self, unit: str) -> tuple[float, float]:
        """Return the ends of the scale that rows of one unit share; of per cent the whole."""
        marks = [mark for row in self.rows if row.unit == unit for mark in row.marks]
        values = [value for one in marks for value in (one.low, one.value, one.high)]
        finite = [value for value in values if math.isfinite(value)]
        low, high = min([0.0, *finite]), max([0.0, *finite])
        if unit == "%" and low >= 0 and high <= PER_CENT:
            return 0.0, PER_CENT
        return low, (high + ROOM * (high - low)) or 1.0

    def placed(self, row: PanelRow) -> list[Placed]:
        """Return the marks of a row on the scale of the panel."""
        low, high = self.span(row.unit)

        def share(value: float) -> float:
            return round(PER_CENT * (min(max(value, low), high) - low) / (high - low), 2)

        found = []
        for mark in row.marks:
            beyond = math.isinf(mark.value)
            at = mark.low if beyond else mark.value
            if math.isfinite(at):
                start, end = share(mark.low), share(mark.high)
                value = said(mark, row.unit) if beyond else with_unit(number(at), row.unit)
                text = f"{mark.label} {value}"
                found.append(Placed(mark, share(at), start, round(end - start, 2), text))
        return found

    def told(self, row: PanelRow) -> str:
        """Return the row in words, for those who do not see it."""
        verdict = f" {row.verdict}." if row.verdict else ""
        listed = ", ".join(one.words for one in self.placed(row))
        label = f"{row.label}: " if row.label else ""
        return f"{label}{listed or row.ours}.{verdict}"


def panels(comparisons: Sequence[PaperComparison], paper: Iterable[PaperFigure]) -> list[Panel]:
    """Return a panel for each figure of the paper, in its order; those that share one in rows.

    What is simulated and what is recorded stand in panels of their own.
    """
    grouped: dict[str, list[PaperFigure]] = defaultdict(list)
    for figure in paper:
        grouped[figure.panel or figure.where].append(figure)
    listed = []
    for title, figures in grouped.items():
        ids = [figure.id for figure in figures]
        found = [one for one in comparisons if one.paper.id in ids]
        for source in sorted({one.source for one in found}):
            listed.append(_panel(title, [one for one in found if one.source == source]))
        if not found:
            text, (_, word) = figures[0].text, SIGNS["absent"]
            listed.append(Panel(title, "", None, (), "absent", text, word))
    return listed


def _panel(title: str, found: Sequence[PaperComparison]) -> Panel:
    rows = tuple(row for one in found for row in _rows(one, len(found) > 1))
    counts = tally(found)
    only = {one.agrees for one in found}
    return Panel(
        title=title,
        link=found[0].page,
        source=found[0].source,
        rows=rows,
        stance=only.pop() if len(only) == 1 else "mixed",
        verdict=next(iter(counts)) if len(counts) == 1 else tally_text(counts),
    )


def _rows(one: PaperComparison, many: bool) -> Iterator[PanelRow]:
    """Yield the rows of a comparison: as many as its marks have parts."""
    parts = list(dict.fromkeys(mark.part for mark in one.marks)) or [""]
    label = (one.label or one.paper.row or words(one.dataset)) if many else ""
    for part in parts:
        own = [mark for mark in one.marks if mark.part == part]
        if len(parts) == 1 and (value := one.paper.value) is not None:
            own.append(Mark("paper", "paper", value, value, value))
        ours = next((mark for mark in own if mark.role == "ours"), None)
        paper = next((mark for mark in own if mark.role in ("paper", "other")), None)
        yield PanelRow(
            label=part or label,
            ours=said(ours, one.unit) if ours else one.result,
            paper=f"{paper.label} {number(paper.value)}" if paper else "",
            marks=tuple(own),
            verdict=one.agrees,
            unit=one.unit,
        )


def said(mark: Mark, unit: str) -> str:
    """Return `0.72 ± 0.12 mm`; an interval that is not even about its value as `14 (0 to 66)`."""
    if math.isinf(mark.value) and math.isfinite(mark.low):  # beyond all that was tried
        return with_unit(f"> {number(mark.low)}", unit)
    below, above = mark.value - mark.low, mark.high - mark.value
    if math.isclose(below, above, rel_tol=1e-6, abs_tol=1e-12):
        return mean_sd(Score(mark.value, above), unit)
    return with_unit(f"{number(mark.value)} ({number(mark.low)} to {number(mark.high)})", unit)


def highlight_panel(one: Highlight, link: str, source: Source) -> Panel:
    """Return the panel of a finding that the paper does not have."""
    rows = []
    for part in dict.fromkeys(mark.part for mark in one.marks):
        own = tuple(mark for mark in one.marks if mark.part == part)
        ours = next(mark for mark in own if mark.role == "ours")
        other = next((mark for mark in own if mark.role in ("other", "paper")), None)
        told = f"{other.label} {number(other.value)}" if other else ""
        rows.append(PanelRow(part, said(ours, one.unit), told, own, unit=one.unit))
    return Panel(one.title, link, source, tuple(rows), None, one.said)
