"""The feature `table`: numbers in a row of an imported table. No waveform is needed."""

from __future__ import annotations

import numpy as np

from ajgdata.store.feature_array import TableRow
from ajgdata.store.imported_table import check_row, read_values
from ajgdata.types.features import TableSettings


def row_values(row: TableRow, settings: TableSettings) -> np.ndarray:
    """Return the values (columns,), float64, of a row of an imported table.

    Raises AudioError for a table that cannot be read and for a row that changed since the import,
    DataError for a column that the table lacks, and ValueError for a row with a missing or infinite
    value.
    """
    check_row(row)
    values, places = read_values(row.path, settings.columns)
    own: np.ndarray = values[row.number - 1]
    with np.errstate(over="ignore"):  # the feature file has float32
        unusable = np.flatnonzero(~np.isfinite(own.astype(np.float32)))
    if len(unusable):
        column = settings.columns[unusable[0]]
        raise ValueError(f"{places[row.number - 1]}: column {column!r} has no finite number")
    return own
