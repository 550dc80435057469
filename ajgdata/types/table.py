"""Tables of results, which experiments and studies return, and which files and figures contain."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

#: A cell; None is a missing value.
Value = float | int | str | bool | None


@dataclass(frozen=True)
class Column:
    """The head of a column."""

    key: str  #: key of the column in each row
    title: str  #: title for people
    unit: str = ""  #: unit of the values; "" for values without a unit


@dataclass(frozen=True)
class Table:
    """Rows with the same keys. Raises ValueError for a row with other keys than `columns`."""

    name: str
    title: str
    note: str  #: one or two sentences that explain how to read the table
    columns: tuple[Column, ...]
    rows: tuple[dict[str, Any], ...]  #: cells (type Value) by column key

    def __post_init__(self) -> None:
        """Check the keys of the rows."""
        keys = [column.key for column in self.columns]
        for number, row in enumerate(self.rows):
            if sorted(row) != sorted(keys):
                raise ValueError(f"row {number} of table {self.name} has {sorted(row)}, not {keys}")

    def column(self, key: str) -> list[Any]:
        """Return the values of one column, in the order of the rows."""
        return [row[key] for row in self.rows]

    def numbers(self, key: str) -> np.ndarray:
        """Return one column as float64 (rows,); a missing value is NaN."""
        return np.array([np.nan if row[key] is None else row[key] for row in self.rows], float)

    def where(self, **values: Value) -> Table:
        """Return the table with only the rows that have these values, by column key."""
        rows = [row for row in self.rows if all(row[k] == v for k, v in values.items())]
        return replace(self, rows=tuple(rows))

    def split_by(self, key: str) -> dict[Any, Table]:
        """Return a table for each value of a column, in order of first appearance."""
        return {value: self.where(**{key: value}) for value in dict.fromkeys(self.column(key))}


def table_of(
    name: str, title: str, rows: Iterable[Mapping[str, Any]], note: str = "", **columns: str
) -> Table:
    """Return a table with the columns `columns`: the title of each key, with a comma and a unit.

    Other keys of `rows` are ignored. NumPy scalars become Python values, and NaN becomes None.

    >>> table = table_of("sizes", "Sizes", [{"edge": 12.0, "x": 1}], edge="edge length, mm")
    >>> table.columns, table.rows
    ((Column(key='edge', title='edge length', unit='mm'),), ({'edge': 12.0},))
    """
    heads = []
    for key, text in columns.items():
        head, _, unit = text.partition(", ")
        heads.append(Column(key, head, unit))
    cells = tuple({key: _cell(row[key]) for key in columns} for row in rows)
    return Table(name, title, note, tuple(heads), cells)


def _cell(value: Any) -> Value:
    """Return a value as a cell: a Python value instead of a NumPy scalar, None instead of NaN."""
    if hasattr(value, "item"):
        value = value.item()
    if isinstance(value, float) and np.isnan(value):
        return None
    return value
