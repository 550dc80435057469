"""Tables of results as Markdown."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ajgdata.report.format import DASH, value
from ajgdata.types.table import Column, Table

Rows = Sequence[Mapping[str, Any]]


def markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return rows of cells as a table."""
    if not all(len(row) == len(head) for row in rows):
        raise ValueError(f"rows of {sorted({len(row) for row in rows})} cells below {len(head)}")
    lines = [head, ["---"] * len(head), *rows]
    escaped = [[cell.replace("|", "\\|") for cell in cells] for cells in lines]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in escaped)


def study_table(table: Table, keys: Sequence[str] = (), without: str = "") -> str:
    """Return a study's table as it is: all columns, or those of `keys`, but for `without`."""
    titles = {column.key: _title(column) for column in table.columns}
    shown = [key for key in keys or titles if key != without]
    rows = [[value(row[key]) for key in shown] for row in table.rows]
    return markdown_table([titles[key] for key in shown], rows)


def _title(column: Column) -> str:
    return f"{column.title}, {column.unit}" if column.unit else column.title


def pivoted(
    rows: Rows,
    by: Sequence[str],
    across: str,
    head: Sequence[str],
    cell: Callable[[Mapping[str, Any]], str],
) -> str:
    """Return one line for each combination of `by` and one column for each value of `across`.

    Both in the order in which they first appear; `head` names the columns of `by`.
    """
    columns = list(dict.fromkeys(row[across] for row in rows))
    lines = list(dict.fromkeys(tuple(row[key] for key in by) for row in rows))
    cells = {(tuple(row[key] for key in by), row[across]): cell(row) for row in rows}
    return markdown_table(
        [*head, *columns],
        [[*map(value, line), *(cells.get((line, one), DASH) for one in columns)] for line in lines],
    )
