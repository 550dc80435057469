"""Page of a simulation study, or of causes of differences: figures and folded tables."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from ajgdata.paths import Paths
from ajgdata.report.format import Source, value
from ajgdata.report.navigation import LEADS, Group
from ajgdata.report.render import DrawnFigure, render
from ajgdata.report.study_tables import ShownTable, holds, numeric, passed, shown_tables
from ajgdata.types.table import Column, Table

#: Columns that show whether a check holds.
CHECK_COLUMNS = ("passed", "outcome")
#: Separator of the sentences of a note.
SENTENCE_END = ". "


class HeadCell(NamedTuple):
    """Title and unit of a column; `css` is a class of the style sheet, or ""."""

    title: str
    unit: str
    css: str


class Cell(NamedTuple):
    """Text of a cell; `css` is a class of the style sheet, or ""."""

    text: str
    css: str


class Row(NamedTuple):
    """A row of a table: the first cell is its head."""

    head: Cell
    cells: list[Cell]


class TableOnPage(NamedTuple):
    """Columns and rows of a table, with its title for people who cannot see it."""

    title: str
    columns: list[HeadCell]
    rows: list[Row]


class FoldedTable(NamedTuple):
    """A folded table: text of the link that opens it, note, and whether it is open at first."""

    summary: str
    note: str
    table: TableOnPage
    is_open: bool


class StudySection(NamedTuple):
    """A table of a study on its page: its first rows, and the folded table; both may be absent.

    `extent` is the number of rows on the page if the file has more, else "".
    """

    name: str
    title: str
    passed: str
    note: str
    table: TableOnPage | None
    folded: FoldedTable | None
    extent: str
    csv: str


@dataclass(frozen=True)
class StudyView:
    """Values of the template of a study; `code` is the hash of the code of a study, or ""."""

    title: str
    lead: str
    sources: Sequence[Source]
    version: str
    commit: str
    code: str
    is_quick: bool
    figures: list[DrawnFigure]
    sections: list[StudySection]


def render_study(
    name: str,
    provenance: Mapping[str, Any],
    tables: Sequence[Table],
    figures: Mapping[str, DrawnFigure],
    nav: Sequence[Group] = (),
    project: Paths | None = None,
    sources: Sequence[Source] = (),
) -> str:
    """Return the page of a study, or of causes, as HTML text.

    `figures` are those of tables, by their names. `sources` are those of the data; default: those
    of the page.
    """
    lead = LEADS[name]
    shown = shown_tables(name, tables)
    first_note = tables[0].note.split(SENTENCE_END) if tables else []
    view = StudyView(
        title=lead.title,
        lead=lead.text,
        sources=sources or lead.sources,
        version=provenance["ajgdata_version"],
        commit=provenance["git_commit"],
        code=provenance.get("code", ""),
        is_quick=provenance["quick"],
        figures=[figures[table.name] for table in tables if table.name in figures],
        sections=[
            _section(name, table, known=first_note if number else ())
            for number, table in enumerate(shown)
        ],
    )
    return render("study.html.j2", here=f"{name}.html", nav=nav, project=project, page=view)


def _section(study: str, shown: ShownTable, known: Collection[str]) -> StudySection:
    """Return a table of a study; its note omits the sentences `known` from the first note."""
    table = shown.table
    note = note_text(table.note, known)
    first = None
    if shown.rows:
        first = _table_on_page(table, shown.columns, shown.rows)
    folded = None
    if shown.folded:
        kind = "All rows and columns" if shown.rows else "Table"
        folded = FoldedTable(
            summary=f"{kind} ({len(table.rows)} rows)",
            note="" if shown.rows else note,
            table=_table_on_page(table, table.columns, shown.folded),
            is_open=shown.is_open,
        )
    return StudySection(
        name=table.name,
        title=table.title,
        passed=passed(table),
        note=note,
        table=first,
        folded=folded,
        extent=_extent(shown),
        csv=f"{study}/{table.name}.csv",
    )


def note_text(note: str, known: Collection[str]) -> str:
    """Return the sentences of a note that are not in `known`.

    >>> from ajgdata.report.study_page import note_text
    >>> note_text("About B. Mean over 5 s.", ["About A", "Mean over 5 s."])
    'About B. '
    """
    if not note:
        return ""
    sentences = [text for text in note.split(SENTENCE_END) if text not in known]
    return "".join(f"{text.removesuffix('.')}. " for text in sentences)


def _extent(shown: ShownTable) -> str:
    """Return how many rows the page shows, if it does not show all rows."""
    n_shown = len(shown.folded or shown.rows)
    n_rows = len(shown.table.rows)
    if n_shown == n_rows:
        return ""
    order = ", failed checks first" if passed(shown.table) else ""
    return f"{n_shown} of {n_rows} rows{order}. "


def _table_on_page(
    table: Table, columns: Sequence[Column], rows: Sequence[Mapping[str, Any]]
) -> TableOnPage:
    """Return columns and rows of a table, with numbers flush right and failed checks marked."""
    css = {column.key: "number" if numeric(table, column.key) else "" for column in columns}
    heads = [HeadCell(column.title, column.unit, css[column.key]) for column in columns]
    shown = []
    for row in rows:
        failed = {key: "fails" for key in CHECK_COLUMNS if holds(row) is False}
        cells = [Cell(value(row[key]), failed.get(key, css[key])) for key in css]
        shown.append(Row(cells[0], cells[1:]))
    return TableOnPage(table.title, heads, shown)
