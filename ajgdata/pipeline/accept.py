"""`ajgdata check NAME --accept`: the present bytes of recordings become the recorded ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ajgdata.paths import RECORDINGS_FILE, Paths
from ajgdata.pipeline.progress import tracked
from ajgdata.store.audio import AudioError, file_sha256
from ajgdata.store.files import alone, csv_bytes, read_csv, write_bytes
from ajgdata.store.sessions import (
    audio_path,
    list_sessions,
    read_dataset,
    read_recordings,
    read_session,
)
from ajgdata.types import DataError

#: Work that excludes an import into the same data set.
ACCEPTING = "accepting recordings of this data set"
HASH_COLUMN = "sha256"


@dataclass(frozen=True)
class Accepted:
    """A recording whose hash is stored now; `before` is the old hash, "" if there was none."""

    session_id: str
    recording_id: str
    before: str
    sha256: str


def accept_recordings(paths: Paths, dataset: str) -> list[Accepted]:
    """Store the hash of each recording that has none, or whose bytes changed, and return them.

    Only the column `sha256` of recordings.csv changes. Recordings whose file cannot be read, and
    sessions whose tables cannot be read, keep their rows; `validate_dataset` reports them. Raises
    DataError for an unknown data set, and while another process writes into the data set.
    """
    read_dataset(paths, dataset)
    accepted = []
    with alone(paths.recordings(dataset), ACCEPTING):
        for name in list_sessions(paths, dataset):
            accepted += _accept_session(paths.session(dataset, name))
    return accepted


def _accept_session(folder: Path) -> list[Accepted]:
    """Store the hashes of one session."""
    try:
        session = read_session(folder)
        recordings = read_recordings(folder)[0]
    except DataError:
        return []
    accepted = []
    for recording in tracked(recordings, f"reading {folder.name}"):
        try:
            digest = file_sha256(audio_path(folder, session, recording))
        except (AudioError, DataError):
            continue
        if digest != recording.sha256:
            names = (folder.name, recording.recording_id)
            accepted.append(Accepted(*names, recording.sha256, digest))
    if accepted:
        _write_hashes(folder / RECORDINGS_FILE, accepted)
    return accepted


def _write_hashes(table: Path, accepted: Sequence[Accepted]) -> None:
    """Write accepted hashes into recordings.csv, atomically; other cells stay."""
    header, rows = read_csv(table)
    if HASH_COLUMN not in header:
        header.append(HASH_COLUMN)
    hashes = {item.recording_id: item.sha256 for item in accepted}
    for row in rows:
        old = row.get(HASH_COLUMN, "")
        row[HASH_COLUMN] = hashes.get(row["recording_id"], old)
    write_bytes(table, csv_bytes(header, rows))
