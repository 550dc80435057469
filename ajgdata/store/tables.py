"""Reading and writing of tables of results as JSON files.

JSON has no infinity. A cell with infinity is stored as an object, `{"number": "inf"}`, and differs
from the text of a label `inf`. NaN is a missing value, null.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.paths import command_for
from ajgdata.store.files import json_bytes, read_json, write_bytes
from ajgdata.types import DataError
from ajgdata.types.formats import FORMAT_KEY, TABLES_FORMAT
from ajgdata.types.table import Column, Table

#: Key of the object that stands for a number that JSON lacks.
_NUMBER = "number"


def write_tables(path: Path, tables: Sequence[Table], **about: Any) -> None:
    """Write `tables`, and facts `about` them by key, to `path` (JSON), atomically."""
    content = {**about, FORMAT_KEY: TABLES_FORMAT.version, "tables": [as_json(t) for t in tables]}
    write_bytes(path, json_bytes(plain(content)))


def read_tables(path: Path) -> tuple[dict[str, Any], list[Table]]:
    """Return `about` and the tables of a file that `write_tables` wrote.

    Raises DataError for a file of another version.
    """
    about = _read(path, "tables")
    return about, [_from_json(table) for table in about.pop("tables")]


def write_measurements(
    path: Path, results: Iterable[tuple[Mapping[str, Any], Sequence[Table]]]
) -> None:
    """Write several `about` with their tables to one file, see `write_tables`."""
    contents = [{**about, "tables": [as_json(t) for t in tables]} for about, tables in results]
    content = {FORMAT_KEY: TABLES_FORMAT.version, "measurements": contents}
    write_bytes(path, json_bytes(plain(content)))


def read_measurements(path: Path) -> list[tuple[dict[str, Any], list[Table]]]:
    """Return each `about` and its tables of a file that `write_measurements` wrote.

    Raises DataError for a file of another version.
    """
    contents = _read(path, "measurements")["measurements"]
    return [(about, [_from_json(t) for t in about.pop("tables")]) for about in contents]


def _read(path: Path, key: str) -> dict[str, Any]:
    """Return the content of a file that has `key`, without the version of its format."""
    content = read_json(path)
    if not isinstance(content, dict):
        raise DataError(path, "does not contain tables", TABLES_FORMAT.fix(command_for(path)))
    TABLES_FORMAT.check(path, content.pop(FORMAT_KEY, None), command_for(path))
    if key not in content:
        problem = f"has no key `{key}`, so another version of ajgdata wrote it"
        raise DataError(path, problem, TABLES_FORMAT.fix(command_for(path)))
    return content


def as_json(table: Table) -> dict[str, Any]:
    """Return the table with its rows as lists in the order of the columns."""
    keys = [column.key for column in table.columns]
    columns = [vars(column) for column in table.columns]
    rows = [[_cell(row[key]) for key in keys] for row in table.rows]
    return {**vars(table), "columns": columns, "rows": rows}


def _cell(value: Any) -> Any:
    """Return a cell as JSON; see the beginning of this module for infinity and NaN."""
    if hasattr(value, "item"):
        value = value.item()
    if isinstance(value, float) and math.isnan(value):
        return None
    if isinstance(value, float) and math.isinf(value):
        return {_NUMBER: str(value)}
    return value


def _from_cell(cell: Any) -> Any:
    """Return the value of a cell that `_cell` wrote."""
    return float(cell[_NUMBER]) if isinstance(cell, dict) else cell


def _from_json(content: Mapping[str, Any]) -> Table:
    """Return the table that `as_json` wrote."""
    columns = tuple(Column(**column) for column in content["columns"])
    keys = [column.key for column in columns]
    cells = ([_from_cell(cell) for cell in row] for row in content["rows"])
    rows = tuple(dict(zip(keys, row, strict=True)) for row in cells)
    return Table(content["name"], content["title"], content["note"], columns, rows)


def plain(value: Any) -> Any:
    """Return nested content as JSON: NaN and infinity become null, and numpy becomes Python."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
