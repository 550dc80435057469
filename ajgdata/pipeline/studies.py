"""Studies of the virtual gripper -> files of figures, and back. Light: Snakemake imports it."""

from __future__ import annotations

import importlib
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ajgdata.store.files import json_bytes, read_json, write_bytes
from ajgdata.store.provenance import code_digest, software
from ajgdata.types import DataError

if TYPE_CHECKING:
    from ajgdata.studies.table import Table

#: Modules of `ajgdata.studies`, in the order of the report.
STUDIES: tuple[str, ...] = ("verification", "stability", "accuracy", "omissions", "materials")
#: Those that measure run time: nothing else shall run beside them.
TIMED = ("accuracy", "omissions")
GALLERY = "gallery"
#: What the gallery and the studies' figures depend on.
GALLERY_CODE = ("gripper", "report", "pipeline/pages", "pipeline/show")
EMBEDDING = "embedding"
#: What the page on embeddings depends on, and those on which recordings are heard.
EMBEDDING_CODE = ("report", "pipeline/embed_page", "pipeline/embed_documents")
EXPLORER_CODE = (*EMBEDDING_CODE, "store/clips", "store/audio", "store/resampling")
STUDY_CODE = ("gripper", "studies", "features", "types", "pipeline/studies")


def run_study(name: str, out: Path, *, quick: bool = False) -> None:
    """Run the study `name` and write its tables, with what made them, to `out` (JSON).

    `quick`: coarser grids and fewer cases. Raises ValueError for a table whose rows do not have
    its columns.
    """
    tables = importlib.import_module(f"ajgdata.studies.{name}").tables(quick)
    write_tables(name, tables, out, quick=quick, code=code_digest(*STUDY_CODE))


def write_tables(name: str, tables: Sequence[Table], out: Path, *, quick: bool, code: str) -> None:
    """Write `tables`, with what made them (`code` is a digest of it), to `out` (JSON)."""
    content = {
        "study": name,
        "quick": quick,
        **software(),
        "code": code,
        "tables": [_plain(table) for table in tables],
    }
    write_bytes(out, json_bytes(content))


def _plain(table: Table) -> dict[str, Any]:
    keys = [column.key for column in table.columns]
    for number, row in enumerate(table.rows):
        if sorted(row) != sorted(keys):
            raise ValueError(f"row {number} of table {table.name} has {sorted(row)}, not {keys}")
    return {
        "name": table.name,
        "title": table.title,
        "note": table.note,
        "columns": [vars(column) for column in table.columns],
        "rows": [{key: _value(value) for key, value in row.items()} for row in table.rows],
    }


def _value(value: Any) -> str | int | float | bool | None:
    """A value that JSON has: numpy's numbers become Python's, what is not finite its name."""
    plain = value.item() if hasattr(value, "item") else value
    return str(plain) if isinstance(plain, float) and not math.isfinite(plain) else plain


def read_study(path: Path) -> tuple[Mapping[str, Any], list[Table]]:
    """What `run_study` wrote: provenance and tables. Raises DataError for another file."""
    from ajgdata.studies.table import Column, Table

    content = read_json(path)
    try:
        tables = [
            Table(
                **{
                    **given,
                    "columns": tuple(Column(**column) for column in given["columns"]),
                    "rows": tuple(given["rows"]),
                }
            )
            for given in content.pop("tables")
        ]
    except (AttributeError, KeyError, TypeError):
        raise DataError(path, "is not a study's file", "delete it and run again") from None
    return content, tables
