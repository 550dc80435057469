"""Tables of labels as people have them: commas, semicolons or tabs, and several joined by a key."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from pathlib import Path

from ajgdata.store.files import read_csv, read_text
from ajgdata.types import DataError

_DELIMITERS = ",;\t"
Rows = list[dict[str, str]]


def read_label_table(path: Path) -> tuple[list[str], Rows]:
    """Return header and rows of a table, as `read_csv` does, whatever stands between its cells.

    That is the mark (comma, semicolon or tab) which makes the most cells of the first line. Raises
    DataError as `read_csv` does.
    """
    first = read_text(path).partition("\n")[0]
    cells = {mark: _cells(first, mark) for mark in _DELIMITERS}
    mark = max(_DELIMITERS, key=cells.__getitem__)  # the first of equals, a comma
    return read_csv(path) if mark == "," else _separated(path, mark)


def _cells(line: str, mark: str) -> int:
    return len(next(csv.reader([line], delimiter=mark), []))


def _separated(path: Path, mark: str) -> tuple[list[str], Rows]:
    """Return header and rows of a table with another mark than a comma."""
    reader = csv.reader(io.StringIO(read_text(path), newline=""), delimiter=mark, strict=True)
    rows: Rows = []
    try:
        header = [cell.strip() for cell in next(reader, [])]
        if wrong := [name for name in header if not name or header.count(name) > 1]:
            problem = f"column {wrong[0]!r} stands twice" if wrong[0] else "a column has no name"
            raise DataError(path, problem, "rename it")
        for cells in reader:
            if any(cell.strip() for cell in cells):
                if len(cells) != len(header):
                    problem = f"{len(cells)} cells, the header has {len(header)}"
                    where = f"{path}:{reader.line_num}"
                    raise DataError(where, problem, "add or remove cells")
                rows.append(dict(zip(header, map(str.strip, cells), strict=True)))
    except csv.Error as error:
        where = f"{path}:{reader.line_num}"
        raise DataError(where, f"not a valid table ({error})", "correct the quotes") from None
    return header, rows


def joined(
    folder: Path, header: list[str], rows: Rows, tables: Mapping[str, str]
) -> tuple[list[str], Rows, list[str]]:
    """Return a table with the columns of further `tables` (file in `folder`: key column) added.

    Each row gets the cells of the row with the same key; what it has already stays. Also returns,
    in words, keys that a further table lacks: their cells are empty. Raises DataError for a key
    that is no column of both tables, or that stands twice in a further one.
    """
    lacking = []
    for file, key in tables.items():
        other_header, other = read_label_table(folder / file)
        for where, columns in ((folder / file, other_header), ("--join", header)):
            if key not in columns:
                raise DataError(where, f"has no column {key!r}", f"there are {columns}")
        by_key: dict[str, dict[str, str]] = {}
        for row in other:
            if by_key.setdefault(row[key], row) is not row:
                raise DataError(folder / file, f"{key} {row[key]!r} stands twice", "keep one row")
        more = [column for column in other_header if column not in header]
        empty = dict.fromkeys(more, "")
        rows = [{**empty, **by_key.get(row[key], {}), **row} for row in rows]
        header = [*header, *more]
        absent = list(dict.fromkeys(row[key] for row in rows if row[key] not in by_key))
        if absent:
            lacking.append(
                f"{file} has no row for {key} {', '.join(absent[:5])}"
                + (f" and {len(absent) - 5} more" if len(absent) > 5 else "")
            )
    return header, rows, lacking
