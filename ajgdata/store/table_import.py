"""Import of the rows of a table as recordings of sessions. The table is copied, and not altered.

Rows of a session and rows of the table are matched by the values of their features, then by
recording_id or number. If they differ, `OnChange` decides which of them is used.
"""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ajgdata.paths import IMPORTED_TABLES_FOLDER, SESSION_FILE, Paths
from ajgdata.store.audio import file_sha256
from ajgdata.store.changes import read_changes
from ajgdata.store.files import copy as copy_file
from ajgdata.store.imported_table import NO_VALUE, ImportedTable, column_values, row_hashes
from ajgdata.store.importing import (
    DIGEST_DIGITS,
    Imported,
    known_grasps,
    merged_row,
    new_id,
    row_cells,
    session_rows,
)
from ajgdata.store.provenance import software
from ajgdata.store.scan import Remarks, Scan, ScannedFile
from ajgdata.store.sessions import inside, read_session, write_session
from ajgdata.types import DataError, OnChange, Recording, Session, describe
from ajgdata.types.shell import shell_quoted

OTHER_VALUES = (
    "has other features in the table. If these are other recordings, import them with --session; "
    "--on-change files takes them"
)
GONE = "no longer in the table; --on-change prune removes it here"
OTHER_TABLE = "is not in this table, but may be in another one. The recording stays"


@dataclass(frozen=True)
class TableSource:
    """A table to import, the columns that are features, and the sha256 of its file."""

    table: ImportedTable
    columns: tuple[str, ...]
    sha256: str


def row_path(number: int, count: int) -> Path:
    """Return the name of a row, counted from 1, of a table with `count` rows.

    Names with equal numbers of digits have the order of the rows.
    """
    return Path(f"{number:0{len(str(count))}}")


def import_rows(
    paths: Paths,
    dataset: str,
    scanned: Scan,
    source: TableSource,
    on_change: OnChange,
    *,
    is_named: bool,
) -> Imported:
    """Write the sessions of `scanned`, whose paths are those of `row_path`, into `dataset`.

    If the user named the session (`is_named`), it can get the rows of another table. Raises
    DataError, before the first change, for a session with recordings of another table.
    """
    result = Imported(remarks=scanned.remarks)
    rows = defaultdict(list)
    for row in scanned.files:
        rows[row.session].append(row)
    sessions = [
        _SessionRows(paths.session(dataset, name), replace(scanned, files=own), source, on_change)
        for name, own in sorted(rows.items())
    ]
    for session in sessions:
        session.match(is_named=is_named)
    for session in sessions:
        session.write(result)
    return result


class _SessionRows:
    """Import of the rows of a table into one session."""

    def __init__(
        self, target: Path, scanned: Scan, source: TableSource, on_change: OnChange
    ) -> None:
        self.target = target
        self.scanned = scanned
        self.source = source
        self.on_change = on_change
        self.remarks: Remarks = scanned.remarks
        #: Rows of the session by recording_id.
        self.rows = session_rows(target)
        #: Labels that people set, which count instead of those of the rows.
        self.changes = read_changes(target)
        self.grasps = known_grasps(self.rows.values())
        self.declared = _new_session(target, scanned, source.columns)
        if (target / SESSION_FILE).is_file():
            self.declared = read_session(target)
        if any(row.table_row is None for row in self.rows.values()):
            problem = "this session has recordings with audio"
            raise DataError(target, problem, "import the table with another --session")
        #: Each row of the table with its recording_id.
        self.names: list[tuple[ScannedFile, str]] = []
        columns = self.declared.table_columns or source.columns
        self._hashes = row_hashes(column_values(source.table, columns), columns)

    def _sha256(self, row: ScannedFile) -> str:
        """Return the checksum of the features in a row of the table."""
        return self._hashes[int(row.path.name) - 1]

    def match(self, *, is_named: bool) -> None:
        """Find the recording_id of each row of the table.

        It is that of a recording with equal features, else that of the row with its recording_id or
        number, else a new one. Raises DataError if the table is probably another one.
        """
        by_sha256: dict[str, list[str]] = defaultdict(list)
        for name, recording in sorted(self.rows.items()):
            by_sha256[recording.sha256].append(name)
        by_number = {row.table_row: name for name, row in self.rows.items()}
        free = set(self.rows)
        names: dict[Path, str] = {}
        for row in self.scanned.files:
            equal = by_sha256[self._sha256(row)]
            own = row.cells["recording_id"] or by_number.get(int(row.path.name), "")
            name = next((name for name in [own, *equal] if name in free and name in equal), "")
            if name:
                names[row.path] = name
                free.discard(name)
        remaining = [row for row in self.scanned.files if row.path not in names]
        is_other = bool(self.rows) and bool(remaining) and len(free) > len(names)
        if is_other and not is_named and self.on_change != OnChange.FILES:
            raise self._other_table(len(names))
        if is_other and is_named:
            self.declared = self.declared.model_copy(update={"has_several_folders": True})
        used = set(self.rows)
        for row in remaining:
            own = row.cells["recording_id"] or by_number.get(int(row.path.name), "")
            is_edited = own in free and not self.declared.has_several_folders
            name = own if is_edited else new_id(row, used)
            names[row.path] = name
            free.discard(name)
            used.add(name)
        self.names = [(row, names[row.path]) for row in self.scanned.files]

    def _other_table(self, shared: int) -> DataError:
        """Return the error of a table that has few rows of the session."""
        problem = (
            f"session {self.target.name!r} has {len(self.rows)} recordings of another table, and "
            f"{shared or 'none'} of the {len(self.scanned.files)} rows of {self.source.table.path}"
        )
        parent = self.source.table.path.resolve().parent.name or "new"
        proposed = shell_quoted(f"{parent}_{self.target.name}")
        fix = (
            f"import it with --session {proposed}, or with --on-change files if its values were"
            " edited"
        )
        return DataError(self.target, problem, fix)

    def write(self, result: Imported) -> None:
        """Write the table, recordings.csv and session.yaml."""
        result.sessions += 1
        file = self._table_name()
        before = dict(self.rows)
        for row, name in self.names:
            self._take(row, name, file, result)
        self._prune(result)
        used = {row.file for row in self.rows.values()}
        stored = self.target / file
        if file in used and not (stored.is_file() and file_sha256(stored) == self.source.sha256):
            copy_file(self.source.table.path, stored)
            os.sync()  # the table is on the disk before recordings.csv names it
        rows = sorted(self.rows.values(), key=lambda row: row.recording_id)
        write_session(self.target, self.declared, rows)
        for name in {row.file for row in before.values()} - used:
            inside(self.target, name).unlink(missing_ok=True)

    def _table_name(self) -> str:
        """Return `file` of the rows: the name of the table, with a digest if another one has it."""
        path = self.source.table.path
        plain = f"{IMPORTED_TABLES_FOLDER}/{path.name}"
        stored = self.target / plain
        is_used = any(row.file == plain for row in self.rows.values())
        if not is_used or (stored.is_file() and file_sha256(stored) == self.source.sha256):
            return plain
        digest = self.source.sha256[:DIGEST_DIGITS]
        return f"{IMPORTED_TABLES_FOLDER}/{path.stem}~{digest}{path.suffix}"

    def _take(self, row: ScannedFile, name: str, file: str, result: Imported) -> None:
        """Import one row as the recording `name`, or list the reason why it is not imported."""
        old = self.rows.get(name)
        sha256 = self._sha256(row)
        is_edited = old is not None and old.sha256 != sha256
        if is_edited and self.on_change != OnChange.FILES:
            self.remarks["kept"].append((name, OTHER_VALUES))
            return
        number = int(row.path.name)
        values: dict[str, Any] = {
            "recording_id": name,
            "file": file,
            "sha256": sha256,
            "table_row": number,
            "labels": row.labels,
        }
        try:
            new = Recording.model_validate(row_cells(row, self.grasps) | values)
        except ValidationError as error:
            problem = describe(error, self.source.table.places[number - 1])
            self.remarks["failed"].append((problem.where, f"{problem.problem}; {problem.fix}"))
            return
        if old is None:
            self.rows[name] = new
            result.added += 1
            return
        has_quality = bool(row.cells["quality"])
        by_hand = self.changes.cells(name, old.sha256)
        new = merged_row(old, new, by_hand, self.on_change, self.remarks, has_quality=has_quality)
        self.rows[name] = new
        place = {"file": old.file, "table_row": old.table_row}
        if new.model_copy(update=place) != old:
            result.changed += 1
        else:
            result.unchanged += 1

    def _prune(self, result: Imported) -> None:
        """Remove the recordings without a row in the table if the user requires it, else list them.

        A recording of another table stays.
        """
        gone = sorted(set(self.rows) - {name for _, name in self.names})
        if self.declared.has_several_folders:
            self.remarks["gone"] += [(name, OTHER_TABLE) for name in gone]
        elif self.on_change != OnChange.PRUNE:
            self.remarks["gone"] += [(name, GONE) for name in gone]
        else:
            for name in gone:
                del self.rows[name]
            result.removed += len(gone)


def _new_session(target: Path, scanned: Scan, columns: tuple[str, ...]) -> Session:
    """Return session.yaml of a new session."""
    return Session(
        session_id=target.name,
        source="virtual-import" if scanned.is_simulated else "import",
        imported_as=scanned.session_texts.get(target.name),
        table_columns=columns,
        software=f"ajgdata {software()['ajgdata_version']}",
        notes=f"imported from a table in a folder named {scanned.folder.name!r}",
    )


def label_cells(table: ImportedTable, columns: Sequence[str]) -> Mapping[Path, dict[str, str]]:
    """Return the cells of each row that are not features, by the name of the row.

    A text of `NO_VALUE` is a missing value, as in features. Only `none` stays: it can be a class.
    """
    labels = [column for column in table.columns if column not in set(columns)]
    missing = NO_VALUE - {"none"}
    count = len(table.rows)
    return {
        row_path(number, count): {
            column: "" if cells[column].lower() in missing else cells[column] for column in labels
        }
        for number, cells in enumerate(table.rows, 1)
    }
