"""Tables of results as JSON files: the one reader and the one writer."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.store.files import json_bytes, read_json, write_bytes
from ajgdata.types.table import Column, Table

#: Numbers that JSON lacks, by the text that is stored.
_INFINITE = {"inf": math.inf, "-inf": -math.inf}


def write_tables(path: Path, tables: Sequence[Table], **about: Any) -> None:
    """Write `tables`, and facts `about` them by key, to `path` (JSON), atomically."""
    write_bytes(path, json_bytes(plain({**about, "tables": [as_json(t) for t in tables]})))


def read_tables(path: Path) -> tuple[dict[str, Any], list[Table]]:
    """Return `about` and the tables of a file that `write_tables` wrote."""
    about = read_json(path)
    return about, [_from_json(table) for table in about.pop("tables")]


def write_measurements(
    path: Path, results: Iterable[tuple[Mapping[str, Any], Sequence[Table]]]
) -> None:
    """Write several `about` with their tables to one file, see `write_tables`."""
    contents = [{**about, "tables": [as_json(t) for t in tables]} for about, tables in results]
    write_bytes(path, json_bytes(plain({"measurements": contents})))


def read_measurements(path: Path) -> list[tuple[dict[str, Any], list[Table]]]:
    """Return each `about` and its tables of a file; none of a file that another function wrote."""
    contents = read_json(path).get("measurements", ())
    return [(about, [_from_json(t) for t in about.pop("tables")]) for about in contents]


def as_json(table: Table) -> dict[str, Any]:
    """Return the table with its rows as lists in the order of the columns; a number that is not
    finite becomes its name."""
    keys = [column.key for column in table.columns]
    columns = [vars(column) for column in table.columns]
    rows = [[_cell(row[key]) for key in keys] for row in table.rows]
    return {**vars(table), "columns": columns, "rows": rows}


def _cell(value: Any) -> Any:
    value = value.item() if hasattr(value, "item") else value
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def _from_json(content: Mapping[str, Any]) -> Table:
    columns = tuple(Column(**column) for column in content["columns"])
    keys = [column.key for column in columns]
    cells = ([_INFINITE.get(cell, cell) for cell in row] for row in content["rows"])
    rows = tuple(dict(zip(keys, row, strict=True)) for row in cells)
    return Table(content["name"], content["title"], content["note"], columns, rows)


def plain(value: Any) -> Any:
    """Return nested content as JSON has it: NaN and infinity become null, numpy becomes Python."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
