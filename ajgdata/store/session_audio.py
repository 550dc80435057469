"""Recordings of a session as they are on disk: files that can be used, and what is wrong."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ajgdata.paths import RECORDINGS_FILE
from ajgdata.store.audio import AudioError, file_sha256
from ajgdata.store.sessions import audio_path, read_recordings, read_session
from ajgdata.types import SESSION_COLUMNS, WHOLE, DataError, Finding, Recording, Session

LABEL_COLUMNS = ("recording_id", "grasp_id", "sample", "object", "quality")


@dataclass(frozen=True)
class AudioFile:
    """The file of a recording and the sha256 of its bytes."""

    recording_id: str
    path: Path
    sha256: str


@dataclass
class SessionAudio:
    """One session: recordings whose file is there and unchanged, a row of labels for each row of
    its table, and issues."""

    session_id: str
    files: list[AudioFile] = field(default_factory=list)
    labels: list[dict[str, str]] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)


def check_session(folder: Path, trusted: Mapping[str, str] | None = None) -> SessionAudio:
    """Read the tables and every file of a session. Problems are findings, never exceptions.

    `trusted` are sha256 by recording_id: these files are not read, and their paths not examined.
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
    for recording in recordings:
        try:
            if digest := known.get(recording.recording_id):
                path = Path(session.audio_root or folder, recording.file)
            else:
                path = audio_path(folder, session, recording)
                digest = checked_sha256(path, recording.sha256, folder.parents[1].name)
            result.files.append(AudioFile(recording.recording_id, path, digest))
            if not recording.sha256:
                result.findings.append(_without_hash(folder, recording))
        except DataError as error:
            code = error.remark.code if isinstance(error, AudioError) else "escapes"
            names = (folder.name, recording.recording_id, recording.file)
            result.findings.append(Finding(*names, "error", code, error.problem, error.fix))
    result.labels = label_rows(session, recordings)
    result.findings.sort()
    return result


def _without_hash(folder: Path, recording: Recording) -> Finding:
    """Return a warning about a recording without a hash: a later change would not be noticed."""
    dataset = folder.parents[1].name
    problem = "`sha256` is empty, so a change of the file is not noticed"
    fix = (
        f"listen to the recording, then use `ajgdata check {dataset} --accept`, "
        "which also accepts all changed files of the data set"
    )
    names = (folder.name, recording.recording_id, recording.file)
    return Finding(*names, "warning", "no_sha256", problem, fix)


def checked_sha256(path: Path, declared: str, dataset: str = "NAME") -> str:
    """Return the sha256 of a file of a data set, which the fix names. Raises AudioError if the file
    cannot be read or is not `declared`."""
    digest = file_sha256(path)
    if declared and digest != declared:
        problem = "its bytes are not those that were recorded (sha256 differs)"
        fix = (
            "restore the file, or accept all new and changed files of the data set with "
            f"`ajgdata check {dataset} --accept`"
        )
        raise AudioError(path, "changed", problem, fix)
    return digest


def label_rows(session: Session, recordings: Sequence[Recording]) -> list[dict[str, str]]:
    """Return a row of labels for each recording of a session, all as text."""
    columns = sorted({column for r in recordings for column in r.labels})
    has_placements = any(r.placement_id for r in recordings)
    standard = [*LABEL_COLUMNS, *(["placement_id"] if has_placements else [])]
    return [
        {c: str(getattr(r, c)) for c in standard}
        | {c: str(getattr(session, c)) for c in SESSION_COLUMNS}
        | {c: r.labels.get(c, "") for c in columns}
        for r in recordings
    ]
