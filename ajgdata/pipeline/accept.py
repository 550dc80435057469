"""`ajgdata check NAME --accept`: store the hashes of the present files of recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ajgdata.paths import RECORDINGS_FILE, Paths
from ajgdata.pipeline.progress import tracked
from ajgdata.store.audio import FileHashes, check_decodable
from ajgdata.store.files import csv_bytes, read_csv, write_bytes
from ajgdata.store.lock import locked
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
    """A recording with a new stored hash; `sha256_before` is the old hash, "" if there was none."""

    session_id: str
    recording_id: str
    sha256_before: str
    sha256: str


@dataclass(frozen=True)
class NotAccepted:
    """A recording whose file cannot be decoded, so its row does not change."""

    session_id: str
    recording_id: str
    problem: str
    fix: str


def accept_recordings(paths: Paths, dataset: str) -> tuple[list[Accepted], list[NotAccepted]]:
    """Store the hash of each recording that has none, or whose bytes changed.

    Only the column `sha256` of recordings.csv changes. Return the recordings with a new hash, and
    the recordings whose file is missing or cannot be decoded. The rows of the latter do not change,
    and neither do sessions whose tables cannot be read; `validate_dataset` reports both. Raises
    DataError for an unknown data set, and while another process writes into the data set.
    """
    if not read_dataset(paths, dataset).features.needs_waveform:
        fix = "import the edited table with `ajgdata import --features TABLE --on-change files`"
        raise DataError(f"{dataset} --accept", "has a table, and no recordings to accept", fix)
    accepted = []
    not_accepted = []
    with locked(paths.recordings(dataset), ACCEPTING):
        for name in list_sessions(paths, dataset):
            new_hashes, damaged = _accept_session(paths.session(dataset, name))
            accepted += new_hashes
            not_accepted += damaged
    return accepted, not_accepted


def _accept_session(folder: Path) -> tuple[list[Accepted], list[NotAccepted]]:
    """Store the hashes of one session; see `accept_recordings`."""
    try:
        session = read_session(folder)
        recordings = read_recordings(folder)[0]
    except DataError:
        return [], []
    accepted = []
    not_accepted = []
    hashes = FileHashes()
    decodable: set[str] = set()
    for recording in tracked(recordings, f"reading {folder.name}"):
        identity = (folder.name, recording.recording_id)
        try:
            path = audio_path(folder, session, recording)
            digest = hashes[path]
            if digest == recording.sha256:
                continue
            if recording.file not in decodable:
                check_decodable(path)
                decodable.add(recording.file)
        except DataError as error:
            not_accepted.append(NotAccepted(*identity, error.problem, error.fix))
            continue
        accepted.append(Accepted(*identity, recording.sha256, digest))
    if accepted:
        _write_hashes(folder / RECORDINGS_FILE, accepted)
    return accepted, not_accepted


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
