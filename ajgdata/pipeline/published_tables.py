"""Tables of features in a published data set without sound: one per session.

The imported table of a session can have rows that are rejected or quarantined. The published table
has the rows of the feature file, and no other columns than features.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ajgdata.paths import IMPORTED_TABLES_FOLDER
from ajgdata.store.features import FeatureColumn, FeatureRows
from ajgdata.store.files import csv_bytes
from ajgdata.store.imported_table import ImportedTable, check_row, read_imported_table
from ajgdata.store.session_audio import table_row
from ajgdata.types import TABLE_ROW, DataError, Recording, Session

#: Published table of a session, relative to the folder of the session.
TABLE_FILE = f"{IMPORTED_TABLES_FOLDER}/features.csv"
_NAME = "recording_id"


@dataclass(frozen=True)
class PublishedTables:
    """The bytes of the table of each session, and the row of each recording, from 1, by name."""

    contents: Mapping[str, bytes]
    rows: Mapping[str, int]


def published_tables(
    recordings: Mapping[str, tuple[Recording, Path]],
    sessions: Mapping[str, Session],
    features: Sequence[str],
) -> PublishedTables:
    """Return the tables of `recordings`, which have their imported table, by name.

    The columns are the `features`, and those whose values are the checksums of the rows of a
    session. The texts are those of the imported tables. Raises DataError for a table that cannot be
    read, and for a row that changed since the import.
    """
    read: dict[Path, ImportedTable] = {}
    lines: dict[str, list[dict[str, str]]] = {}
    rows = {}
    for name, (recording, path) in recordings.items():
        session = name.partition("/")[0]
        own = lines.setdefault(session, [])
        row = table_row(sessions[session], path, recording)
        if row is None:
            problem = f"recording {name!r} has sound, and the data set has tables"
            raise DataError(path, problem, "remove its session")
        check_row(row)
        if path not in read:
            read[path] = read_imported_table(path)
        cells = read[path].rows[row.number - 1]
        columns = dict.fromkeys((*row.columns, *features))
        own.append({_NAME: recording.recording_id, **{column: cells[column] for column in columns}})
        rows[name] = len(own)
    contents = {name: csv_bytes([*own[0]], own) for name, own in lines.items()}
    return PublishedTables(contents, rows)


def with_published_rows(store: FeatureRows, tables: PublishedTables) -> dict[str, FeatureColumn]:
    """Return the columns of a feature file with the rows of the published tables."""
    numbers = np.asarray([*tables.rows.values()], np.float64)
    return {**store.columns, TABLE_ROW: FeatureColumn(numbers, store.columns[TABLE_ROW].attrs)}
