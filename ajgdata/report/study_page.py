"""The tables of a study of the virtual gripper -> a page of the report."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ajgdata.paths import Paths
from ajgdata.report.blocks import Illustration, TableFigure
from ajgdata.report.navigation import LEADS, Group
from ajgdata.report.render import Picture, render
from ajgdata.types.table import Table, Value


def placed_figures(
    figures: Iterable[TableFigure], tables: Sequence[Table]
) -> dict[str, list[Illustration]]:
    """Return the figures of each table that has rows, by table; nothing is drawn yet."""
    filled = {table.name: table for table in tables if table.rows}
    placed: dict[str, list[Illustration]] = {}
    for figure in figures:
        if figure.table in filled:
            placed.setdefault(figure.table, []).append(figure.of(filled[figure.table]))
    return placed


def render_study(
    name: str,
    provenance: Mapping[str, Any],
    tables: Sequence[Table],
    figures: Mapping[str, Picture],
    placed: Mapping[str, Sequence[Illustration]],
    nav: Sequence[Group] = (),
    project: Paths | None = None,
) -> str:
    """Return the page as HTML text. `figures` by name; `placed` has those of each table.

    Raises jinja2.UndefinedError for a figure that is not drawn.
    """
    return render(
        "study.html.j2",
        figures,
        project=project,
        title=LEADS[name].title,
        lead=LEADS[name].text,
        provenance=provenance,
        tables=tables,
        placed={table.name: placed.get(table.name, ()) for table in tables},
        numeric=numeric,
        passed=passed,
        holds=holds,
        nav=nav,
        here=f"{name}.html",
    )


def numeric(table: Table, key: str) -> bool:
    """Return whether a column holds numbers, finite or not, and perhaps gaps: set flush right."""
    found = [value for value in table.column(key) if value is not None]
    return bool(found) and all(
        value in ("inf", "-inf", "nan") if isinstance(value, str) else not isinstance(value, bool)
        for value in found
    )


def holds(row: Mapping[str, Value]) -> bool | None:
    """Return whether a row that says `passed`, or `expected` and `outcome`, says that all is well.

    None for a row that says neither.
    """
    if "passed" in row:
        return None if row["passed"] is None else bool(row["passed"])
    if {"expected", "outcome"} <= set(row):
        return row["expected"] == row["outcome"]
    return None


def passed(table: Table) -> str:
    """Return `12 of 13 hold.` for a table whose rows can hold or fail, else nothing."""
    said = [verdict for row in table.rows if (verdict := holds(row)) is not None]
    return f"{sum(said)} of {len(said)} hold." if said else ""
