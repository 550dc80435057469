"""Tables of features in a published data set without sound: one per session.

The imported table of a session can have rows that are rejected or quarantined. The published table
has the rows and columns of the feature file, with the texts of the imported table.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ajgdata.paths import IMPORTED_TABLES_FOLDER
from ajgdata.store.features import FeatureColumn, FeatureRows, text_column
from ajgdata.store.files import csv_bytes, sha256_of
from ajgdata.store.imported_table import ImportedTable, read_imported_table
from ajgdata.types import TABLE_ROW, DataError, Recording

#: Published table of a session, relative to the folder of the session.
TABLE_FILE = f"{IMPORTED_TABLES_FOLDER}/features.csv"
_NAME = "recording_id"


@dataclass(frozen=True)
class PublishedTables:
    """The bytes of the table of each session, and the row of each recording, from 1, by name."""

    contents: Mapping[str, bytes]
    rows: Mapping[str, int]

    def hashes(self) -> dict[str, str]:
        """Return the sha256 of the table of each recording."""
        of_session = {name: sha256_of(content) for name, content in self.contents.items()}
        return {name: of_session[name.partition("/")[0]] for name in self.rows}


def published_tables(
    recordings: Mapping[str, tuple[Recording, Path]], columns: Sequence[str]
) -> PublishedTables:
    """Return the tables of `recordings`, which have their imported table, by name.

    `columns` are the features. Raises DataError for a table that cannot be read, or lacks a row.
    """
    read: dict[Path, ImportedTable] = {}
    lines: dict[str, list[dict[str, str]]] = {}
    rows = {}
    for name, (recording, path) in recordings.items():
        if path not in read:
            read[path] = read_imported_table(path)
        session = name.partition("/")[0]
        own = lines.setdefault(session, [])
        number = recording.table_row or 0
        if not 0 < number <= len(read[path].rows):
            fix = "restore the table, or import it again"
            raise DataError(path, f"has no row {number} for recording {name!r}", fix)
        cells = read[path].rows[number - 1]
        own.append({_NAME: recording.recording_id, **{column: cells[column] for column in columns}})
        rows[name] = len(own)
    header = [_NAME, *columns]
    contents = {session: csv_bytes(header, own) for session, own in lines.items()}
    return PublishedTables(contents, rows)


def with_published_rows(store: FeatureRows, tables: PublishedTables) -> dict[str, FeatureColumn]:
    """Return the columns of a feature file with row and sha256 of the published tables."""
    numbers = np.asarray([*tables.rows.values()], np.int64)
    meaning = store.columns["sha256"].attrs["long_name"]
    return {
        **store.columns,
        TABLE_ROW: FeatureColumn(numbers, store.columns[TABLE_ROW].attrs),
        "sha256": text_column([*tables.hashes().values()], long_name=meaning),
    }
