"""Tables of labels as people have them: commas, semicolons or tabs, and several joined by a key."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from ajgdata.store.files import read_text
from ajgdata.types import DataError

_DELIMITERS = ",;\t"
#: First line by which a spreadsheet names the delimiter.
_HINT = re.compile(r'"?sep=(.)"?;*,*', re.IGNORECASE)
Rows = list[dict[str, str]]


def read_label_table(path: Path) -> tuple[list[str], Rows]:
    """Return header and rows of a table with commas, semicolons or tabs, as stripped text.

    The delimiter is that of a first line `sep=;`, or else the one that splits the header into the
    most cells. Empty lines, and empty cells after the last column, are dropped. Raises DataError
    for an empty table, a nameless or doubled column, and a row of another length.
    """
    text, skipped = read_text(path), 0
    if hint := _HINT.fullmatch(text.partition("\n")[0].strip()):
        text, skipped = text.partition("\n")[2], 1
    first = text.partition("\n")[0]
    counts = {mark: len(next(csv.reader([first], delimiter=mark), [])) for mark in _DELIMITERS}
    mark = hint[1] if hint else max(_DELIMITERS, key=counts.__getitem__)  # a comma, if equal
    lines = [(n, cells) for n, cells in _lines(path, text, mark, skipped) if any(cells)]
    if not lines:
        raise DataError(path, "is empty", "write one line with column names and one line per file")
    width = max(len(_without_empty_end(cells)) for _, cells in lines)
    header = lines[0][1][:width]  # without empty columns at the end
    if wrong := [name for name in header if not name or header.count(name) > 1]:
        place = f"column {header.index('') + 1} has no name" if "" in wrong else ""
        raise DataError(path, place or f"column {wrong[0]!r} occurs twice", "rename it")
    if not lines[1:]:
        raise DataError(path, "has column names but no rows", "add one line per file")
    for line, cells in lines[1:]:
        if not len(_without_empty_end(cells)) <= len(header) <= len(cells):
            problem = f"{len(cells)} cells, the header has {len(header)}"
            raise DataError(f"{path}:{line}", problem, "add or remove cells, or quote them")
    return header, [dict(zip(header, cells, strict=False)) for _, cells in lines[1:]]


def _lines(path: Path, text: str, mark: str, skipped: int) -> Iterator[tuple[int, list[str]]]:
    """Yield number and stripped cells of each line of `text`, before which lines were skipped."""
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=mark, strict=True)
    try:
        for cells in reader:
            yield skipped + reader.line_num, [cell.strip() for cell in cells]
    except csv.Error as error:
        where = f"{path}:{skipped + reader.line_num}"
        raise DataError(where, f"not a valid table ({error})", "correct the quotes") from None


def _without_empty_end(cells: list[str]) -> list[str]:
    width = max((number for number, cell in enumerate(cells, 1) if cell), default=0)
    return cells[:width]


def joined(
    folder: Path, header: list[str], rows: Rows, tables: Mapping[str, str]
) -> tuple[list[str], Rows, list[str]]:
    """Return a table with the columns of further `tables` (file in `folder`: key column) added.

    Each row gets the cells of the row with the same key; its own cells stay. Also returns notes on
    keys that a table lacks (their cells are empty), and on columns that are not used because the
    first table has a column of that name. Raises DataError for a key that is not a column of both
    tables, or that a joined table has twice.
    """
    notes = []
    for file, key in tables.items():
        other_header, other = read_label_table(folder / file)
        for where, columns in ((folder / file, other_header), ("--join", header)):
            if key not in columns:
                raise DataError(where, f"has no column {key!r}", f"there are {columns}")
        by_key: dict[str, dict[str, str]] = {}
        for row in other:
            if by_key.setdefault(row[key], row) is not row:
                raise DataError(folder / file, f"{key} {row[key]!r} occurs twice", "keep one row")
        more = [column for column in other_header if column not in header]
        if unused := [column for column in other_header if column in header and column != key]:
            notes.append(f"{file}: not used, because a table before has it: {', '.join(unused)}")
        empty = dict.fromkeys(more, "")
        rows = [{**empty, **by_key.get(row[key], {}), **row} for row in rows]
        header = [*header, *more]
        absent = list(dict.fromkeys(row[key] for row in rows if row[key] not in by_key))
        if absent:
            notes.append(
                f"{file} has no row for {key} {', '.join(absent[:5])}"
                + (f" and {len(absent) - 5} more" if len(absent) > 5 else "")
            )
    return header, rows, notes
