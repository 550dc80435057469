"""What every study returns: a table of figures that a person can read and a test can assert."""

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

    def column(self, key: str) -> list[Value]:
        """Values of one column, in the order of the rows."""
        return [row[key] for row in self.rows]
