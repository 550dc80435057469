"""Table of results of a page: all models of its tasks, with run time and published values."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import NamedTuple

from ajgdata.report.format import DASH, Source, words
from ajgdata.report.report_data import ResultRow, TaskSection


class ShownResult(NamedTuple):
    """A row of the table. `paper` is empty if the row above has the same published value."""

    row: ResultRow
    paper: str
    paper_source: str


class ResultsGroup(NamedTuple):
    """Rows of one part of the tests, with its heading; the heading may be empty."""

    heading: str
    rows: tuple[ShownResult, ...]


class ResultsSection(NamedTuple):
    """Rows of one task, and the place to which links lead."""

    anchor: str
    title: str
    source: Source
    groups: tuple[ResultsGroup, ...]


class ResultsTable(NamedTuple):
    """The table of results; the last column, of published values, may be absent."""

    sections: tuple[ResultsSection, ...]
    has_paper: bool
    n_columns: int


def results_table(sections: Sequence[TaskSection]) -> ResultsTable | None:
    """Return the table of results of tasks; None without any row."""
    shown = tuple(_section(section) for section in sections if section.rows)
    if not shown:
        return None
    has_paper = any(row.paper for section in sections for row in section.rows)
    return ResultsTable(shown, has_paper, n_columns=7 if has_paper else 6)


def _section(section: TaskSection) -> ResultsSection:
    groups = []
    for part, rows in groupby(section.rows, key=lambda row: row.part):
        heading = f"{words(section.task)}, {part}" if part else ""
        groups.append(ResultsGroup(heading, _with_paper(list(rows))))
    return ResultsSection(section.anchor, section.title, section.source, tuple(groups))


def _with_paper(rows: Sequence[ResultRow]) -> tuple[ShownResult, ...]:
    """Return the rows of a part; a published value is in the first of its successive rows."""
    shown = []
    above = None
    for row in rows:
        if row.paper is None:
            shown.append(ShownResult(row, DASH, ""))
        elif row.paper == above:
            shown.append(ShownResult(row, "", ""))
        else:
            shown.append(ShownResult(row, row.paper.text, f"{row.paper.where}; {row.paper.source}"))
        above = row.paper
    return tuple(shown)
