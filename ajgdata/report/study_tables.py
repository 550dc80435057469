"""Rows and columns that the page of a study shows first; the complete tables are folded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from ajgdata.types.table import Column, Table, Value

#: Rows that a page shows first, in all tables together.
MAX_ROWS = 8
#: Columns of each table that a page shows first.
MAX_COLUMNS = 6
#: Rows of a complete table; its CSV file has all.
MAX_FOLDED_ROWS = 300
#: Pages whose tables are complete and not folded.
UNFOLDED = ("causes",)
#: Rows of each table of these pages.
MAX_UNFOLDED_ROWS = 30
#: Keys of the columns that are shown first, for tables that do not begin with them.
FIRST_COLUMNS: dict[str, tuple[str, ...]] = {
    "accuracy": ("kind", "source", "setting", "error", "ratio", "is_default"),
    "differences": ("kind", "band", "error_db", "relative", "correlation", "of_scatter"),
    "omissions": ("part", "kind", "saved", "feature", "measured", "verdict"),
    "verification": ("title", "value", "cap", "order", "least_order", "passed"),
}


class ShownTable(NamedTuple):
    """A table on a page: its first `columns` and `rows`, and the rows that are `folded`.

    `folded` is empty if the first rows and columns are the complete table. `is_open` is True if a
    folded row is a failed check, which the page then shows.
    """

    table: Table
    columns: tuple[Column, ...]
    rows: list[dict[str, Any]]
    folded: list[dict[str, Any]]
    is_open: bool = False


def shown_tables(study: str, tables: Sequence[Table]) -> list[ShownTable]:
    """Return the tables of a page, with up to `MAX_ROWS` rows that are shown first.

    The first tables use up these rows, and later tables are completely folded.
    """
    if study in UNFOLDED:
        return [
            ShownTable(table, table.columns, ordered_rows(table)[:MAX_UNFOLDED_ROWS], [])
            for table in tables
        ]
    shown = []
    remaining = MAX_ROWS
    for table in tables:
        shown.append(_shown(table, remaining))
        remaining -= len(shown[-1].rows)
    return shown


def _shown(table: Table, max_rows: int) -> ShownTable:
    """Return a table of which up to `max_rows` rows are shown first."""
    rows = ordered_rows(table)
    columns = first_columns(table)
    first = rows[:max_rows]
    if len(first) == len(rows) and len(columns) == len(table.columns):
        return ShownTable(table, columns, first, [])
    is_open = any(holds(row) is False for row in rows[max_rows:])
    return ShownTable(table, columns, first, rows[:MAX_FOLDED_ROWS], is_open)


def first_columns(table: Table) -> tuple[Column, ...]:
    """Return up to `MAX_COLUMNS` columns: those of `FIRST_COLUMNS`, else the first ones."""
    by_key = {column.key: column for column in table.columns}
    keys = [key for key in FIRST_COLUMNS.get(table.name, ()) if key in by_key]
    return tuple(by_key[key] for key in keys or tuple(by_key)[:MAX_COLUMNS])


def ordered_rows(table: Table) -> list[dict[str, Any]]:
    """Return the rows of a table, failed checks first."""
    return sorted(table.rows, key=lambda row: holds(row) is not False)


def holds(row: Mapping[str, Value]) -> bool | None:
    """Return whether a check holds; None for a row that is not a check."""
    passed = row.get("passed")
    return None if passed is None else bool(passed)


def passed(table: Table) -> str:
    """Return a sentence such as `12 of 13 checks passed.`; "" for a table without checks."""
    verdicts = [holds(row) for row in table.rows]
    checks = [verdict for verdict in verdicts if verdict is not None]
    if not checks:
        return ""
    return f"{sum(checks)} of {len(checks)} checks passed."


def numeric(table: Table, key: str) -> bool:
    """Return whether a column has numbers, which are set flush right; cells may be missing."""
    cells = [cell for cell in table.column(key) if cell is not None]
    return bool(cells) and not any(isinstance(cell, (str, bool)) for cell in cells)
