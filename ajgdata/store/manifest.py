"""Manifests: what the sessions of a data set hold now, as files that change only when it does.

The workflow's jobs depend on manifests, never on WAV files: a manifest is rewritten only if its
content changed, so touching a recording redoes nothing and editing it redoes what depends on it.
Files and hashes (input of the features) are kept apart from labels (joined on merging).
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterable
from pathlib import Path
from typing import Any

from ajgdata.paths import Paths
from ajgdata.store.files import csv_bytes, json_bytes, read_json, write_bytes, write_if_changed
from ajgdata.store.sessions import audio_path, list_sessions, read_recordings, read_session
from ajgdata.types import DataError, Finding, Recording, Session

LABEL_COLUMNS = ("recording_id", "grasp_id", "sample", "object", "quality")
SESSION_COLUMNS = ("source", "gripper", "medium")
WHOLE_SESSION = "*"


class HashCache:
    """SHA-256 of files, recomputed only when size, times or inode changed."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.known: dict[str, list[Any]] = read_json(path) if path.is_file() else {}
        self.changed = False

    def sha256(self, file: Path) -> str:
        """Hash of `file`; raises OSError when it cannot be read."""
        stat = file.stat()
        key, mark = str(file.absolute()), [stat.st_size, stat.st_mtime_ns]
        mark += [stat.st_ctime_ns, stat.st_ino]
        entry = self.known.setdefault(key, [])
        if entry[:4] != mark:
            with file.open("rb") as stream:
                entry[:] = [*mark, hashlib.file_digest(stream, "sha256").hexdigest()]
            self.changed = True
        return str(entry[4])

    def save(self) -> None:
        """Write the cache if it learnt anything."""
        if self.changed:
            write_bytes(self.path, json_bytes(self.known))


def refresh(paths: Paths, dataset: str, incomplete: Collection[str] = ()) -> list[str]:
    """Bring the manifests of a data set up to date; returns the sessions that have one.

    Idempotent, and writes nothing when nothing changed: a dry run may call it. Sessions of
    `incomplete` are still being acquired and get no manifest.
    """
    cache = HashCache(paths.hash_cache)
    sessions = [name for name in list_sessions(paths, dataset) if name not in incomplete]
    for name in sessions:
        write(paths, dataset, name, cache)
    cache.save()
    _drop_others(paths, dataset, keep=sessions)
    return sessions


def write(paths: Paths, dataset: str, session: str, cache: HashCache | None = None) -> None:
    """Bring the manifests of one session up to date."""
    known = cache if cache is not None else HashCache(paths.hash_cache)
    content, labels = survey(paths, dataset, session, known)
    write_if_changed(paths.audio_manifest(dataset, session), json_bytes(content))
    columns = list(labels[0]) if labels else [*LABEL_COLUMNS, *SESSION_COLUMNS]
    write_if_changed(paths.label_manifest(dataset, session), csv_bytes(columns, labels))


def survey(
    paths: Paths, dataset: str, name: str, cache: HashCache
) -> tuple[dict[str, Any], list[dict[str, str]]]:
    """One session's audio manifest and label rows. Never raises: what is wrong is a finding."""
    folder = paths.session(dataset, name)
    try:
        session = read_session(folder)
        recordings, findings = read_recordings(folder)
    except DataError as error:
        file = Path(error.where.split(":")[0]).name
        problem = f"{file}: {error.problem}"
        whole = Finding(name, WHOLE_SESSION, file, "error", "bad_session", problem, error.fix)
        return _manifest(paths, folder, None, [], [whole]), []
    files = []
    for recording in recordings:
        try:
            path = audio_path(folder, session, recording)
            files.append((recording, path, _checked_hash(cache, path, recording)))
        except DataError as error:
            findings.append(_finding(name, recording, error))
    return _manifest(paths, folder, session, files, findings), _labels(session, recordings)


def read_manifest(path: Path) -> tuple[dict[str, Any], list[Finding]]:
    """An audio manifest: its content and the findings in it."""
    content = read_json(path)
    return content, [Finding(**finding) for finding in content["findings"]]


def _checked_hash(cache: HashCache, path: Path, recording: Recording) -> str:
    try:
        found = cache.sha256(path)
    except OSError:
        raise DataError(
            "missing", "there is no such file", "restore it or remove its row"
        ) from None
    if recording.sha256 and found != recording.sha256:
        raise DataError(
            "changed",
            "its bytes are not those that were recorded (sha256 differs)",
            "restore the file, or accept it with `ajgdata seal`",
        )
    return found


def _finding(session: str, recording: Recording, error: DataError) -> Finding:
    code = error.where if error.where in ("missing", "changed") else "escapes"
    return Finding(
        session, recording.recording_id, recording.file, "error", code, error.problem, error.fix
    )


def _manifest(
    paths: Paths,
    folder: Path,
    session: Session | None,
    files: Iterable[tuple[Recording, Path, str]],
    findings: list[Finding],
) -> dict[str, Any]:
    excitation = None
    if session and session.excitation:
        played = folder / session.excitation.file
        excitation = {"path": _spelled(paths, played), "sha256": session.excitation.sha256}
    return {
        "session_id": folder.name,
        "source": session.source if session else "import",
        "excitation": excitation,
        "recordings": [
            {"recording_id": r.recording_id, "path": _spelled(paths, path), "sha256": digest}
            for r, path, digest in files
        ],
        "findings": [vars(finding) for finding in sorted(findings)],
    }


def _spelled(paths: Paths, path: Path) -> str:
    """Relative to the project where possible, so that manifests survive a move of the project."""
    absolute, root = path.absolute(), paths.root.absolute()
    return str(absolute.relative_to(root) if absolute.is_relative_to(root) else absolute)


def _labels(session: Session, recordings: list[Recording]) -> list[dict[str, str]]:
    columns = sorted({column for r in recordings for column in r.labels} - set(SESSION_COLUMNS))
    return [
        {c: str(getattr(r, c)) for c in LABEL_COLUMNS}
        | {c: str(getattr(session, c)) for c in SESSION_COLUMNS}
        | {c: r.labels.get(c, "") for c in columns}
        for r in recordings
    ]


def _drop_others(paths: Paths, dataset: str, keep: list[str]) -> None:
    """Forget manifests of sessions that are gone, so that nothing is built from them."""
    for path in paths.audio_manifest(dataset, "x").parent.glob("*.audio.json"):
        session = path.name.removesuffix(".audio.json")
        if session not in keep:
            path.unlink()
            paths.label_manifest(dataset, session).unlink(missing_ok=True)
