"""Tables of findings, and findings of rejected recordings."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from ajgdata.paths import command_for
from ajgdata.store.files import csv_bytes, read_csv, write_bytes
from ajgdata.types import DataError, Finding

#: Codes of files that cannot be decoded.
_FILE_CODES = frozenset(
    ("missing", "unreadable", "empty", "damaged", "truncated", "no_samples", "implausible")
)
#: Codes of recordings that differ from their row, and of rows and sessions that cannot be read.
_TABLE_CODES = frozenset(
    ("changed", "escapes", "bad_row", "bad_table", "duplicate_id", "bad_session")
)
#: Codes of recordings that could not be read as their table describes them. Other errors are
#: properties of a readable sound (silent, too short, another rate) or decisions of a person
#: (`rejected`).
UNREADABLE = _FILE_CODES | _TABLE_CODES
FINDING_COLUMNS = tuple(field.name for field in dataclasses.fields(Finding))


def read_findings(path: Path) -> list[Finding]:
    """Return the findings of a table.

    Raises DataError for an invalid file. The columns are the version of the format: a table with
    other columns is of another version.
    """
    header, rows = read_csv(path)
    if tuple(header) != FINDING_COLUMNS:
        problem = "its columns are of another version of ajgdata"
        fix = f"run `{command_for(path)}`, which writes it again"
        raise DataError(path, problem, fix)
    return [Finding(**row) for row in rows]  # type: ignore[arg-type]  # level is checked where it is written


def write_findings(path: Path, findings: Sequence[Finding]) -> None:
    """Write a table of findings, sorted."""
    write_bytes(path, csv_bytes(FINDING_COLUMNS, map(vars, sorted(findings))))


def unreadable(findings: Iterable[Finding]) -> list[Finding]:
    """Return the findings of recordings that could not be read."""
    return [f for f in findings if f.level == "error" and f.code in UNREADABLE]


def is_rejected(row: Mapping[str, str]) -> bool:
    """Return True if a person rejected this recording (column `quality`)."""
    return row["quality"].lower() == "reject"


def rejected(session: str, table: Mapping[str, Mapping[str, str]]) -> dict[str, Finding]:
    """Return a note for each recording of a session that is marked `reject`, by recording_id."""
    problem = "quality is `reject`"
    fix = "accept it with `ajgdata label NAME RECORDING --ok`, or set quality to ok, to use it"
    return {
        name: Finding(session, name, "", "note", "rejected", problem, fix)
        for name, row in table.items()
        if is_rejected(row)
    }


def without_rejected(findings: Iterable[Finding], notes: Sequence[Finding]) -> list[Finding]:
    """Return the findings, with those of rejected recordings replaced by their `notes`."""
    names = {(note.session_id, note.recording_id) for note in notes}
    return [*notes, *(f for f in findings if (f.session_id, f.recording_id) not in names)]
