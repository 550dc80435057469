"""Tables of results: what experiments and studies return, store, draw and are compared by."""

from __future__ import annotations

from dataclasses import dataclass

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
    rows: tuple[dict[str, Value], ...]

    def __post_init__(self) -> None:
        keys = [column.key for column in self.columns]
        for number, row in enumerate(self.rows):
            if sorted(row) != sorted(keys):
                raise ValueError(f"row {number} of table {self.name} has {sorted(row)}, not {keys}")

    def column(self, key: str) -> list[Value]:
        """Return the values of one column, in the order of the rows."""
        return [row[key] for row in self.rows]
