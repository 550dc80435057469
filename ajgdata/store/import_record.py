"""What the last import of a session found: by it a later one tells corrections from changes."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field, ValidationError

from ajgdata.paths import IMPORT_FILE
from ajgdata.store.files import json_bytes, read_json, write_if_changed
from ajgdata.types import Recording
from ajgdata.types.base import Strict

#: Columns of recordings.csv that a folder tells, beside the labels.
_TOLD = ("grasp_id", "object", "quality")


class Origin(Strict):
    """One recording as the folder told it: `cells` hold its columns and labels as text."""

    folder: str = Field(description="that was imported")
    source: str = Field(description="path inside it")
    sha256: str = Field(description="of that file")
    cells: dict[str, str]
    sample_rate_hz: int = Field(0, description="of the recording; 0 if it cannot be read")


class ImportRecord(Strict):
    """import.json of a session: where each recording came from, by recording_id."""

    recordings: dict[str, Origin] = Field({}, description="by recording_id")
    played: str = Field("", description="sha256 of the played sound in the folder")


def read_record(session: Path) -> ImportRecord | None:
    """Return the record of a session folder; None if it has none that can be used."""
    path = session / IMPORT_FILE
    if not path.is_file():
        return None
    try:
        return ImportRecord.model_validate(read_json(path))
    except ValidationError:
        return None  # then nothing is known of earlier imports, and every label here is kept


def write_record(session: Path, record: ImportRecord) -> None:
    """Write the record of a session folder, if it changed."""
    write_if_changed(session / IMPORT_FILE, json_bytes(record.model_dump(mode="json")))


def cells_of(recording: Recording) -> dict[str, str]:
    """Return all that a folder tells of a recording, as text."""
    told = {column: str(getattr(recording, column)) for column in _TOLD}
    return {**recording.labels, **told, "sample": str(recording.sample)}


def with_cells(recording: Recording, cells: dict[str, str]) -> Recording:
    """Return the recording with `cells` (see `cells_of`) in their columns."""
    labels = {c: text for c, text in cells.items() if c not in (*_TOLD, "sample")}
    told = {column: cells[column] for column in _TOLD}
    return recording.model_copy(update={**told, "sample": int(cells["sample"]), "labels": labels})


def merged(
    here: dict[str, str], found: dict[str, str], before: dict[str, str] | None
) -> tuple[dict[str, str], list[str]]:
    """Return the cells of a recording that stands in the table and in the folder.

    What changed in the folder since `before`, the last import, is taken over; what was changed
    `here` since is kept, and said in words. Where no import is known, everything here is kept.
    """
    cells, kept = {**found, **here}, []
    for column, text in found.items():
        own = here.get(column, text)
        if own == text:
            continue
        if before is not None and own == before.get(column):
            cells[column] = text
        else:
            kept.append(f"{column} {own!r} here, {text!r} in the folder")
    return cells, kept
