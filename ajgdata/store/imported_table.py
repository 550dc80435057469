"""Tables of features without recordings: a row per recording, as CSV, TSV or Parquet."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.store.audio import AudioError
from ajgdata.store.feature_array import TableRow
from ajgdata.store.files import sha256_of
from ajgdata.store.label_table import read_label_table
from ajgdata.store.labels import number
from ajgdata.types import DataError
from ajgdata.types.extras import optional_packages

#: Suffix of tables that are read with their types.
PARQUET = ".parquet"
#: Texts of cells without a value, in lower case, as programs write them.
NO_VALUE = {"", "nan", "-nan", "+nan", "na", "n/a", "#n/a", "<na>", "null", "none"}
#: Texts of infinite numbers, in lower case.
INFINITE = {"inf", "-inf", "+inf", "infinity", "-infinity", "+infinity"}
#: First word of a comment with which a table states that its features are simulated.
SIMULATED = "simulated"


@dataclass(frozen=True)
class ImportedTable:
    """The rows of a table as texts.

    - `columns`: names of the columns, in their order
    - `rows`: cells by column of each row; a missing value is ""
    - `places`: `<file>:<line>` of each row, for messages; `<file>, row <row>` in Parquet
    - `notes`: names and reasons of lines and columns that are ignored
    - `is_simulated`: whether the first comment of the table begins with *simulated*
    """

    path: Path
    columns: tuple[str, ...]
    rows: Sequence[Mapping[str, str]]
    places: Sequence[str]
    notes: Sequence[tuple[str, str]] = field(default_factory=list)
    is_simulated: bool = False

    def texts(self, column: str) -> list[str]:
        """Return the cells (n,) of a column."""
        return [row[column] for row in self.rows]


def read_imported_table(path: Path) -> ImportedTable:
    """Return a table; the suffix `.parquet` decides, and all other files are text.

    Raises DataError for a file that is no table, for doubled names of columns, for a table without
    rows, and for a Parquet file if pyarrow is not installed.
    """
    if path.is_dir():
        raise DataError(path, "is a folder", "name a table: CSV, TSV or Parquet")
    table = _read_parquet(path) if path.suffix.lower() == PARQUET else _read_text(path)
    if not table.rows:
        raise DataError(path, "has no rows", "export the table again")
    return table


def _read_text(path: Path) -> ImportedTable:
    """Return a table of text with commas, semicolons or tabs between the cells."""
    table = read_label_table(path, ())
    rows = [{column: cell.strip() for column, cell in cells.items()} for _, cells in table.rows]
    places = [f"{path.name}:{line}" for line, _ in table.rows]
    columns = tuple(rows[0]) if rows else ()
    comments = [reason.partition(": ")[2] for name, reason in table.notes if name == "line 1"]
    is_simulated = any(comment.strip("'\"# ").lower().startswith(SIMULATED) for comment in comments)
    return ImportedTable(path, columns, rows, places, table.notes, is_simulated)


def _read_parquet(path: Path) -> ImportedTable:
    """Return the columns of a Parquet file as the texts that a CSV file has."""
    with optional_packages(f"import of {path.name}"):
        import pyarrow
        import pyarrow.parquet
    try:
        table = pyarrow.parquet.read_table(path)
    except FileNotFoundError:
        raise DataError(path, "there is no such file", "correct the name") from None
    except (OSError, pyarrow.ArrowException) as error:
        problem = f"is not a readable Parquet file ({' '.join(str(error).split())[:100]})"
        raise DataError(path, problem, "export the table again") from None
    names = [str(name).strip() for name in table.column_names if name != "__index_level_0__"]
    doubled = [name for name in names if names.count(name) > 1]
    if doubled:
        problem = f"{doubled.count(doubled[0])} columns are named {doubled[0]!r}"
        raise DataError(path, problem, "rename all but one")
    nested = [f.name for f in table.schema if pyarrow.types.is_nested(f.type)]
    if nested:
        problem = f"column {nested[0]!r} has lists, not one value per row"
        raise DataError(path, problem, "export one column for each value")
    texts = {
        name: _texts(table.column(place).to_pylist(), str(table.schema.field(place).type))
        for place, name in enumerate(names)
    }
    rows = [dict(zip(texts, cells, strict=True)) for cells in zip(*texts.values(), strict=True)]
    places = [f"{path.name}, row {row}" for row in range(1, len(rows) + 1)]
    comment = (table.schema.metadata or {}).get(b"comment", b"").decode(errors="replace")
    is_simulated = comment.lower().startswith(SIMULATED)
    return ImportedTable(path, tuple(names), rows, places, [], is_simulated)


def _texts(values: Sequence[Any], type_name: str) -> list[str]:
    """Return values of Parquet as the cells of a CSV file; "" is missing.

    A number has the shortest text of its type: 0.1 instead of 0.10000000149011612 for a float32.
    """
    short = {"float": np.float32, "halffloat": np.float16}.get(type_name)
    texts = []
    for value in values:
        if value is None or (isinstance(value, float) and math.isnan(value)):
            texts.append("")
        else:
            texts.append(str(short(value) if short else value).strip())
    return texts


def column_values(table: ImportedTable, columns: Sequence[str]) -> np.ndarray:
    """Return the numbers (n, columns), float64; NaN for a missing or infinite value.

    Raises DataError for a column that the table lacks, and for a cell with another text.
    """
    missing = [column for column in columns if column not in table.columns]
    if missing:
        problem = f"has no column {missing[0]!r}"
        if len(missing) > 1:
            problem += f", and {len(missing) - 1} other columns are missing"
        fix = "use a table with the columns of `features.columns` in dataset.yaml"
        raise DataError(table.path, problem, fix)
    values = np.empty((len(table.rows), len(columns)))
    for place, column in enumerate(columns):
        for row, text in enumerate(table.texts(column)):
            try:
                values[row, place] = cell_value(text)
            except ValueError:
                problem = f"column {column!r} has {text!r}, which is not a number"
                fix = "correct the cell, or remove the column from the features"
                raise DataError(table.places[row], problem, fix) from None
    return values


def row_hashes(values: np.ndarray, columns: Sequence[str]) -> list[str]:
    """Return the sha256 of each row of values (n, columns), float64, and of the names of columns.

    It does not depend on the format of the table and on its other columns.
    """
    names = "\n".join(columns).encode()
    return [sha256_of(names + row.astype("<f8").tobytes()) for row in values]


def read_values(path: Path, columns: tuple[str, ...]) -> tuple[np.ndarray, list[str]]:
    """Return the values (n, columns), float64, of a table, and the place of each row.

    The last tables are kept, and read again if the time or the size of their file changes. Raises
    DataError for a table that cannot be read.
    """
    try:
        state = path.stat()
    except OSError as error:
        problem = f"cannot be read ({error.strerror})"
        raise DataError(path, problem, "restore the table") from None
    return _read_values(path, state.st_mtime_ns, state.st_size, columns)


@lru_cache(maxsize=4)
def _read_values(
    path: Path, time_ns: int, size: int, columns: tuple[str, ...]
) -> tuple[np.ndarray, list[str]]:
    """Return the values of a table whose file has this time and size."""
    table = read_imported_table(path)
    return column_values(table, columns), list(table.places)


def check_row(row: TableRow) -> None:
    """Raise AudioError if a table cannot be read, or if a row has other values than at the import.

    A table with other values than numbers is read again for each row.
    """
    try:
        values, _ = read_values(row.path, row.columns)
    except DataError as error:
        raise AudioError(row.path, "bad_table", error.problem, error.fix) from None
    own = values[row.number - 1 : row.number]
    if row_hashes(own, row.columns) != [row.sha256]:
        problem = f"the features in row {row.number} are not those of the import (sha256 differs)"
        fix = "restore the table, or import the edited original with --on-change files"
        raise AudioError(row.path, "changed", problem, fix)


def cell_value(text: str) -> float:
    """Return the number in a cell; NaN for a missing or infinite value.

    Raises ValueError for any other text.
    """
    if text.lower() in NO_VALUE or text.lower() in INFINITE:
        return math.nan
    return number(text)
