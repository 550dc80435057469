"""metadata.parquet: the table of a published data set with the type of each column.

CSV has no types. Its readers guess them: the label `NA` becomes a missing value, and `01` becomes
the number 1. Hugging Face and Croissant have no setting for this, but read the types of Parquet.
"""

from __future__ import annotations

import io

import pyarrow
import pyarrow.parquet

from ajgdata.store.publishing.table import PublishedColumn, PublishedTable


def parquet_bytes(table: PublishedTable) -> bytes:
    """Return metadata.parquet; an empty cell of `table` is a missing value (null)."""
    types = {
        "string": pyarrow.string(),
        "integer": pyarrow.int64(),
        "number": pyarrow.float64(),
    }
    columns = {
        column.name: pyarrow.array(_values(table, column), types[column.data_type])
        for column in table.columns
    }
    buffer = io.BytesIO()
    pyarrow.parquet.write_table(pyarrow.table(columns), buffer)
    return buffer.getvalue()


def _values(table: PublishedTable, column: PublishedColumn) -> list[str | int | float | None]:
    """Return the values (n,) of a column; None if missing."""
    read = {"string": str, "integer": int, "number": float}[column.data_type]
    cells = [row[column.name] for row in table.rows]
    return [read(cell) if cell else None for cell in cells]
