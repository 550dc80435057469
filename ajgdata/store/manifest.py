"""Manifests: what the sessions of a data set hold now, as files that change only when it does.

The workflow's jobs depend on manifests, never on WAV files: a manifest is rewritten only if its
content changed, so touching a recording redoes nothing and editing it redoes what depends on it.
Files and hashes (input of the features) are kept apart from labels (joined on merging).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from pathlib import Path
from typing import Any

from ajgdata.paths import Paths
from ajgdata.store.files import (
    csv_bytes,
    json_bytes,
    read_json,
    why_no_file,
    write_if_changed,
)
from ajgdata.store.hashes import HashCache
from ajgdata.store.sessions import (
    audio_path,
    inside,
    list_sessions,
    read_recordings,
    read_session,
)
from ajgdata.store.surveyed import Surveyed
from ajgdata.types import SESSION_COLUMNS, DataError, Finding, Recording, Session

LABEL_COLUMNS = ("recording_id", "grasp_id", "sample", "object", "quality")
WHOLE_SESSION = "*"


def refresh(
    paths: Paths,
    dataset: str,
    incomplete: Collection[str] = (),
    each: Callable[[list[str]], Iterable[str]] = iter,
) -> list[str]:
    """Bring the manifests of a data set up to date; return the sessions that have one.

    Idempotent, and writes nothing when nothing changed. Sessions of `incomplete` are still being
    acquired and get no manifest. `each` goes through the sessions, and may show how far it is.
    """
    cache, surveyed = HashCache(paths.hash_cache), Surveyed(paths, dataset)
    sessions = [name for name in list_sessions(paths, dataset) if name not in incomplete]
    for name in each(sessions):
        if not surveyed.is_current(name):
            began = surveyed.marks_of_tables(name)
            write(paths, dataset, name, cache)
            surveyed.note(name, cache.seen | began)
    cache.save()
    surveyed.save(sessions)
    _drop_others(paths, dataset, keep=sessions)
    return sessions


def outdated(
    paths: Paths,
    dataset: str,
    incomplete: Collection[str] = (),
    each: Callable[[list[str]], Iterable[str]] = iter,
) -> dict[Path, bytes]:
    """Return the content that `refresh` would write, by file, and write nothing.

    A session that has no manifest yet is not read: the content of its manifests is given as empty.
    """
    cache, surveyed = HashCache(paths.hash_cache), Surveyed(paths, dataset)
    changed: dict[Path, bytes] = {}
    sessions = [name for name in list_sessions(paths, dataset) if name not in incomplete]
    for name in each(sessions):
        if surveyed.is_current(name):
            continue
        files = paths.audio_manifest(dataset, name), paths.label_manifest(dataset, name)
        if all(file.is_file() for file in files):
            new = contents(paths, dataset, name, cache)
            changed |= {file: new[file] for file in files if file.read_bytes() != new[file]}
        else:
            changed |= dict.fromkeys(files, b"")
    return changed


def write(paths: Paths, dataset: str, session: str, cache: HashCache | None = None) -> None:
    """Bring the manifests of one session up to date."""
    known = cache if cache is not None else HashCache(paths.hash_cache)
    for file, content in contents(paths, dataset, session, known).items():
        write_if_changed(file, content)


def contents(paths: Paths, dataset: str, session: str, cache: HashCache) -> dict[Path, bytes]:
    """Return what the two manifests of a session should hold now, by file."""
    files, labels = survey(paths, dataset, session, cache)
    columns = list(labels[0]) if labels else [*LABEL_COLUMNS, *SESSION_COLUMNS]
    return {
        paths.audio_manifest(dataset, session): json_bytes(files),
        paths.label_manifest(dataset, session): csv_bytes(columns, labels),
    }


def survey(
    paths: Paths, dataset: str, name: str, cache: HashCache
) -> tuple[dict[str, Any], list[dict[str, str]]]:
    """Return one session's audio manifest and label rows. Never raises: what is wrong is a
    finding."""
    folder = paths.session(dataset, name)
    try:
        session = read_session(folder)
        recordings, findings = read_recordings(folder)
    except DataError as error:
        file = Path(error.where.split(":")[0]).name
        problem = f"{file}: {error.problem}"
        whole = Finding(name, WHOLE_SESSION, file, "error", "bad_session", problem, error.fix)
        return _manifest(paths, folder, None, [], [whole]), []
    for grasp, reason in session.skipped.items():
        problem, _, fix = reason.rpartition("; ")
        findings.append(Finding(name, grasp, "", "warning", "skipped", problem, fix))
    files = []
    for recording in recordings:
        try:
            path = audio_path(folder, session, recording)
            files.append((recording, path, _checked_hash(cache, path, recording.sha256)))
        except DataError as error:
            findings.append(_finding(name, recording, error))
    try:
        played = _excitation(paths, folder, session, cache)
    except DataError as error:
        played = None
        problem = f"the played sound cannot be used: {error.problem}"
        findings.append(
            Finding(name, WHOLE_SESSION, "", "warning", "bad_excitation", problem, error.fix)
        )
    return _manifest(paths, folder, session, files, findings, played), label_rows(
        session, recordings
    )


def _excitation(
    paths: Paths, folder: Path, session: Session, cache: HashCache
) -> dict[str, str] | None:
    declared = session.excitation
    if declared is None:
        return None
    path = inside(folder, declared.file)
    return {
        "path": _spelled(paths, path),
        "sha256": _checked_hash(cache, path, declared.sha256),
    }


def read_manifest(path: Path) -> tuple[dict[str, Any], list[Finding]]:
    """Return an audio manifest: its content and the findings in it."""
    content = read_json(path)
    return content, [Finding(**finding) for finding in content["findings"]]


def _checked_hash(cache: HashCache, path: Path, declared: str) -> str:
    if wrong := why_no_file(path):
        raise DataError("missing", *wrong)
    try:
        found = cache.sha256(path)
    except OSError as error:
        problem = f"cannot be read ({error.strerror})"
        raise DataError("missing", problem, "check disk and permissions") from None
    if declared and found != declared:
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
    excitation: dict[str, str] | None = None,
) -> dict[str, Any]:
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


def label_rows(session: Session, recordings: Sequence[Recording]) -> list[dict[str, str]]:
    """Return a row of labels for each recording of a session, all as text."""
    columns = sorted({column for r in recordings for column in r.labels})
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
