"""Tables of results: what experiments and studies return, store, draw and are compared by."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

Value = float | int | str | bool | None


@dataclass(frozen=True)
class Column:
    """`key` of the rows, its title for people, and the unit of its values ("" for none)."""

    key: str
    title: str
    unit: str = ""


@dataclass(frozen=True)
class Table:
    """Rows of values by column key; `note` says in a sentence or two how to read them."""

    name: str
    title: str
    note: str
    columns: tuple[Column, ...]
    rows: tuple[dict[str, Any], ...]  #: cells are of type Value

    def __post_init__(self) -> None:
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
        """Return the table with those rows alone that have these values."""
        chosen = (row for row in self.rows if all(row[k] == v for k, v in values.items()))
        return replace(self, rows=tuple(chosen))

    def split_by(self, key: str) -> dict[Any, Table]:
        """Return a table for each value of a column, in order of first appearance."""
        return {value: self.where(**{key: value}) for value in dict.fromkeys(self.column(key))}


def table_of(
    name: str, title: str, rows: Iterable[Mapping[str, Any]], note: str = "", **columns: str
) -> Table:
    """Return a table with a column for each of `columns`, key and title; a unit follows a comma.

    Numbers of NumPy become Python's, and NaN becomes a missing value.
    """
    parts = {key: text.partition(", ") for key, text in columns.items()}
    heads = tuple(Column(key, text, unit) for key, (text, _, unit) in parts.items())
    cells = tuple({key: _plain(row[key]) for key in columns} for row in rows)
    return Table(name, title, note, heads, cells)


def _plain(value: Any) -> Value:
    value = value.item() if hasattr(value, "item") else value
    return None if isinstance(value, float) and np.isnan(value) else value
