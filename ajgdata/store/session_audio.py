"""Files of the recordings of a session, their labels, and issues."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from ajgdata.paths import RECORDINGS_FILE
from ajgdata.store.audio import AudioError, FileHashes, file_sha256
from ajgdata.store.feature_array import TableRow
from ajgdata.store.sessions import audio_path, read_recordings, read_session
from ajgdata.types import (
    SEGMENT_COLUMNS,
    SESSION_COLUMNS,
    TABLE_ROW,
    WHOLE,
    WHOLE_FILE,
    DataError,
    Finding,
    Recording,
    Segment,
    Session,
    part_id,
)

LABEL_COLUMNS = ("recording_id", "grasp_id", "sample", "object", "quality")


class PlayedFile(NamedTuple):
    """The file of the sound that a session played, and the sha256 that session.yaml states."""

    path: Path
    sha256: str


@dataclass(frozen=True)
class AudioFile:
    """The file of a recording, the sha256 of its bytes, the part that is the recording, and the
    file of the played sound, if there is one.

    A recording without a waveform is a row of a table, whose checksum is not compared here."""

    recording_id: str
    path: Path
    sha256: str
    segment: Segment = WHOLE_FILE
    played: PlayedFile | None = None
    table_row: TableRow | None = None

    @property
    def sound_id(self) -> str:
        """Text that is equal for equal sounds (see `Segment.sound_id`)."""
        number = None if self.table_row is None else self.table_row.number
        return part_id(self.sha256, self.segment, number)


@dataclass
class SessionAudio:
    """One session: the files that exist and are unchanged, the labels of all rows of its table, and
    issues."""

    session_id: str
    files: list[AudioFile] = field(default_factory=list)
    labels: list[dict[str, str]] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)


def played_file(folder: Path, session: Session) -> PlayedFile | None:
    """Return the file of the sound that the session in `folder` played; None if it has none."""
    if session.excitation is None:
        return None
    return PlayedFile(folder / session.excitation.file, session.excitation.sha256)


def check_session(folder: Path, trusted: Mapping[str, str] | None = None) -> SessionAudio:
    """Read the tables and all files of a session. Problems become findings and not exceptions.

    `trusted` are sha256 by recording_id; the files of trusted recordings are not read. A file with
    several segments is read once.
    """
    result = SessionAudio(folder.name)
    try:
        session = read_session(folder)
        recordings, result.findings = read_recordings(folder)
    except DataError as error:
        file = Path(error.where.split(":")[0]).name
        problem = f"{file}: {error.problem}"
        names = (folder.name, WHOLE, file)
        result.findings = [Finding(*names, "error", "bad_session", problem, error.fix)]
        return result
    is_unfinished = session.acquisition is not None and not session.acquisition.finished
    if not recordings and not result.findings and not is_unfinished:
        problem = f"{RECORDINGS_FILE} has a header and no recordings"
        fix = "import or record some, or remove the folder of this session"
        names = (folder.name, WHOLE, RECORDINGS_FILE)
        result.findings.append(Finding(*names, "error", "no_recordings", problem, fix))
    for grasp, reason in session.skipped.items():
        problem, _, fix = reason.rpartition("; ")
        result.findings.append(Finding(folder.name, grasp, "", "warning", "skipped", problem, fix))
    known = trusted or {}
    hashes = FileHashes()
    played = played_file(folder, session)
    for recording in recordings:
        try:
            digest = known.get(recording.recording_id)
            if digest:
                path = Path(session.audio_root or folder, recording.file)
            else:
                path = audio_path(folder, session, recording)
                if recording.table_row is None:
                    digest = hashes[path]
                    check_unchanged(path, digest, recording.sha256, folder.parents[1].name)
                else:
                    digest = recording.sha256
            row = table_row(session, path, recording)
            result.files.append(
                AudioFile(recording.recording_id, path, digest, recording.segment, played, row)
            )
            if not recording.sha256:
                result.findings.append(_without_hash(folder, recording))
        except DataError as error:
            code = error.remark.code if isinstance(error, AudioError) else "escapes"
            names = (folder.name, recording.recording_id, recording.file)
            result.findings.append(Finding(*names, "error", code, error.problem, error.fix))
    result.findings += _overlaps(folder.name, recordings)
    result.labels = label_rows(session, recordings)
    result.findings.sort()
    return result


def _without_hash(folder: Path, recording: Recording) -> Finding:
    """Return a warning about a recording without a hash, whose changes cannot be detected."""
    dataset = folder.parents[1].name
    problem = "`sha256` is empty, so a change of the file is not noticed"
    fix = (
        f"listen to the recording, then use `ajgdata check {dataset} --accept`, "
        "which also accepts all changed files of the data set"
    )
    names = (folder.name, recording.recording_id, recording.file)
    return Finding(*names, "warning", "no_sha256", problem, fix)


def _overlaps(session: str, recordings: Sequence[Recording]) -> list[Finding]:
    """Return a warning about each segment that begins before the end of an earlier segment of its
    file. If both are of one grasp, it is a note, because folds do not separate them."""
    of_file: dict[str, list[Recording]] = defaultdict(list)
    for recording in recordings:
        if recording.quality != "reject" and recording.table_row is None:
            of_file[recording.file].append(recording)
    findings = []
    for rows in of_file.values():
        before, *following = sorted(rows, key=lambda row: row.segment)
        for after in following:
            earlier = before
            before = max(before, after, key=lambda row: row.segment.end_s)
            is_copy = earlier.segment == after.segment  # the check of copies reports it
            if is_copy or after.segment.start_s >= earlier.segment.end_s:
                continue
            names = (session, after.recording_id, after.file)
            problem = (
                f"its segment {after.segment} overlaps {earlier.segment} of {earlier.recording_id}"
            )
            fix = "correct start_s and end_s in recordings.csv, or give both the same grasp_id"
            issue = Finding(*names, "warning", "overlap", problem, fix)
            if earlier.grasp_id == after.grasp_id:
                fix = "nothing to do, if both share these samples by intention"
                issue = Finding(*names, "note", "overlap", problem, fix)
            findings.append(issue)
    return findings


def checked_sha256(path: Path, declared: str) -> str:
    """Return the sha256 of a file of a data set.

    Raises AudioError if the file cannot be read, or if its hash is not the `declared` one.
    """
    digest = file_sha256(path)
    check_unchanged(path, digest, declared)
    return digest


def check_unchanged(path: Path, digest: str, declared: str, dataset: str = "NAME") -> None:
    """Raise AudioError if the sha256 of a file is not the `declared` one; "" is any."""
    if declared and digest != declared:
        problem = "its bytes are not those that were recorded (sha256 differs)"
        fix = (
            "restore the file, or accept all new and changed files of the data set with "
            f"`ajgdata check {dataset} --accept`"
        )
        raise AudioError(path, "changed", problem, fix)


def table_row(session: Session, path: Path, recording: Recording) -> TableRow | None:
    """Return the row of the table `path` that is a recording; None for sound."""
    if recording.table_row is None:
        return None
    columns = session.table_columns or ()
    return TableRow(path, recording.table_row, columns, recording.sha256)


def label_rows(session: Session, recordings: Sequence[Recording]) -> list[dict[str, str]]:
    """Return a row of labels for each recording of a session, all as text."""
    columns = sorted({column for recording in recordings for column in recording.labels})
    standard = list(LABEL_COLUMNS)
    if any(recording.placement_id for recording in recordings):
        standard.append("placement_id")
    has_segments = any(recording.segment != WHOLE_FILE for recording in recordings)
    parts = list(SEGMENT_COLUMNS) if has_segments else []
    if any(recording.table_row is not None for recording in recordings):
        parts.append(TABLE_ROW)
    of_session = {name: str(getattr(session, name)) for name in SESSION_COLUMNS}
    return [
        {
            **{name: str(getattr(recording, name)) for name in standard},
            **{name: _part_text(getattr(recording, name)) for name in parts},
            **of_session,
            **{name: recording.labels.get(name, "") for name in columns},
        }
        for recording in recordings
    ]


def _part_text(value: float | None) -> str:
    """Return a time of a segment, or a row of a table, as a label.

    "" is the beginning or end of the file, and no row.
    """
    return "" if value is None else str(value)
