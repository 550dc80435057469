"""The feature `table`: numbers in a row of an imported table. No waveform is needed."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np

from ajgdata.store.imported_table import column_values, read_imported_table
from ajgdata.types import DataError
from ajgdata.types.features import TableSettings


def row_values(path: Path, row: int, settings: TableSettings) -> np.ndarray:
    """Return the values (columns,), float64, of a row of the table `path`, counted from 1.

    Raises ValueError for a row that the table lacks, and for a row with a missing or infinite
    value.
    """
    try:
        state = path.stat()
        values, places = _values(path, state.st_mtime_ns, state.st_size, settings.columns)
    except OSError as error:
        raise ValueError(f"{path.name} cannot be read ({error.strerror})") from None
    except DataError as error:
        raise ValueError(f"{error.where}: {error.problem}") from None
    if row > len(values):
        raise ValueError(f"{path.name} has {len(values)} rows, not {row}")
    own: np.ndarray = values[row - 1]
    with np.errstate(over="ignore"):  # the feature file has float32
        unusable = np.flatnonzero(~np.isfinite(own.astype(np.float32)))
    if len(unusable):
        column = settings.columns[unusable[0]]
        raise ValueError(f"{places[row - 1]}: column {column!r} has no finite number")
    return own


@lru_cache(maxsize=2)
def _values(
    path: Path, time_ns: int, size: int, columns: tuple[str, ...]
) -> tuple[np.ndarray, list[str]]:
    """Return the values (n, columns) of a table, and the place of each row.

    The table is read again if the time or the size of its file changes.
    """
    table = read_imported_table(path)
    return column_values(table, columns), list(table.places)
