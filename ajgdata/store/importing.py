"""Bring a folder of recordings in as sessions. Audio is copied or referenced, never altered."""

from __future__ import annotations

import shutil
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ajgdata.paths import AUDIO_FOLDER, EXCITATION_FILE, RECORDINGS_FILE, SESSION_FILE, Paths
from ajgdata.store.audio import file_sha256, inspect_audio
from ajgdata.store.files import replacing
from ajgdata.store.provenance import software
from ajgdata.store.scan import Scan, ScannedFile
from ajgdata.store.sessions import (
    audio_path,
    inside,
    read_recordings,
    read_session,
    write_session,
)
from ajgdata.types import DataError, Excitation, Recording, Session, describe


@dataclass
class Imported:
    """Counts of one import. `conflicts` are recordings whose bytes differ from those held."""

    sessions: int = 0
    added: int = 0
    relabelled: int = 0
    unchanged: int = 0
    conflicts: list[str] = field(default_factory=list)


def import_scan(
    paths: Paths,
    dataset: str,
    folder: Path,
    scanned: Scan,
    *,
    copy: bool,
    replace: bool,
    progress: Callable[[], object] = lambda: None,
) -> Imported:
    """Write the sessions of `scanned` below `folder` into `dataset`.

    Running it again adds what is new, takes over changed labels, and keeps recordings that are no
    longer in the folder, quality, further columns and what was completed in session.yaml. A
    recording whose bytes differ from those held is left alone and listed in `conflicts`, unless
    `replace`. Raises DataError, before anything is written, for a session that cannot be added to.
    """
    sessions: dict[str, list[ScannedFile]] = defaultdict(list)
    for entry in scanned.files:
        sessions[entry.session].append(entry)
    result = Imported(sessions=len(sessions))
    before = {
        name: _before(paths.session(dataset, name), copy=copy, folder=folder) for name in sessions
    }
    for name, members in sorted(sessions.items()):
        target = paths.session(dataset, name)
        session, held = before[name]
        rates = {session.sample_rate_hz} if session and held else set()
        for entry, recording_id in zip(members, _ids(members, held, copy=copy), strict=True):
            recording = _recording(folder, entry, recording_id, copy=copy)
            _take(folder / entry.path, target, held, recording, result, copy=copy, replace=replace)
            progress()
        rates |= _rates(folder, members)
        changed: dict[str, Any] = {"sample_rate_hz": rates.pop() if len(rates) == 1 else None}
        if played := _excitation(folder, scanned.excitations.get(name), target):
            changed["excitation"] = played
        session = session or Session(
            session_id=name,
            source="import",
            audio_root=None if copy else str(folder.absolute()),
            software=f"ajgdata {software()['ajgdata_version']}",
            notes=f"imported from a folder named {folder.name!r}",
        )
        rows = sorted(held.values(), key=lambda r: r.recording_id)
        write_session(target, session.model_copy(update=changed), rows)
    return result


def seal(paths: Paths, dataset: str, session: str) -> int:
    """Accept the bytes that are there: write the present sha256 of every recording and of the
    played sound.

    Returns how many recordings changed. Missing files keep their row.
    """
    folder = paths.session(dataset, session)
    declared = read_session(folder)
    recordings, findings = read_recordings(folder)
    if findings:
        raise DataError(folder / RECORDINGS_FILE, findings[0].problem, findings[0].fix)
    sealed = []
    for recording in recordings:
        path = audio_path(folder, declared, recording)
        digest = file_sha256(path) if path.is_file() else recording.sha256
        sealed.append(recording.model_copy(update={"sha256": digest}))
    if (played := declared.excitation) and (path := inside(folder, played.file)).is_file():
        played = played.model_copy(update={"sha256": file_sha256(path)})
    write_session(folder, declared.model_copy(update={"excitation": played}), sealed)
    return sum(new != old for new, old in zip(sealed, recordings, strict=True))


def _held(target: Path) -> dict[str, Recording]:
    if not (target / RECORDINGS_FILE).is_file():
        return {}
    recordings, findings = read_recordings(target)
    if findings:
        raise DataError(
            target / RECORDINGS_FILE,
            f"{findings[0].problem}; nothing was imported into this session",
            findings[0].fix,
        )
    return {r.recording_id: r for r in recordings}


def _before(
    target: Path, *, copy: bool, folder: Path
) -> tuple[Session | None, dict[str, Recording]]:
    """Return the session as it was, after checking that recordings may be added to it."""
    held = _held(target)
    if not (target / SESSION_FILE).is_file():  # new, or an import that was interrupted
        return None, held
    session = read_session(target)
    if session.source != "import":
        raise DataError(
            target, f"this session's source is {session.source}", "import with another --session"
        )
    root = session.audio_root
    if root != (None if copy else str(folder.absolute())):
        how = f"references {root}" if root else "holds copies"
        raise DataError(
            target, f"this session {how}", "import the same way again, or with another --session"
        )
    return session, held


def _ids(members: Sequence[ScannedFile], held: Mapping[str, Recording], *, copy: bool) -> list[str]:
    """Return the id that a file has, else its path inside the folder without suffix; with suffix
    where two files would share it."""
    known = {recording.file: name for name, recording in held.items()}
    stems = [entry.path.with_suffix("").as_posix() for entry in members]
    counts = Counter(stems)
    ids: list[str] = []
    for entry, stem in zip(members, stems, strict=True):
        new = stem if counts[stem] == 1 and stem not in held else entry.path.as_posix()
        ids.append(known.get(_file(entry, copy=copy), new))
    return ids


def _file(entry: ScannedFile, *, copy: bool) -> str:
    return (Path(AUDIO_FOLDER, entry.path) if copy else entry.path).as_posix()


def _recording(folder: Path, entry: ScannedFile, recording_id: str, *, copy: bool) -> Recording:
    try:
        return Recording(
            recording_id=recording_id,
            file=_file(entry, copy=copy),
            sha256=file_sha256(folder / entry.path),
            grasp_id=entry.grasp,
            sample=entry.sample,
            object=entry.object,
            labels=dict(entry.labels),
        )
    except ValidationError as error:
        raise describe(error, folder / entry.path) from None


def _take(
    source: Path,
    target: Path,
    held: dict[str, Recording],
    recording: Recording,
    result: Imported,
    *,
    copy: bool,
    replace: bool,
) -> None:
    old = held.get(recording.recording_id)
    if old and old.sha256 != recording.sha256 and not replace:
        result.conflicts.append(recording.recording_id)
        return
    if old:  # what people added stays
        labels = {**old.labels, **recording.labels}
        recording = recording.model_copy(update={"quality": old.quality, "labels": labels})
    destination = target / recording.file
    if copy and not (destination.is_file() and file_sha256(destination) == recording.sha256):
        with replacing(destination) as temporary:
            shutil.copyfile(source, temporary)
    held[recording.recording_id] = recording
    if old is None:
        result.added += 1
    elif old != recording:
        result.relabelled += 1
    else:
        result.unchanged += 1


def _excitation(folder: Path, source: Path | None, target: Path) -> Excitation | None:
    if source is None:
        return None
    played = target / EXCITATION_FILE
    with replacing(played) as temporary:
        shutil.copyfile(folder / source, temporary)
    return Excitation(
        file=EXCITATION_FILE, sha256=file_sha256(played), description=f"imported {source.name}"
    )


def _rates(folder: Path, members: Sequence[ScannedFile]) -> set[int]:
    """Return rates of the readable recordings."""
    rates = set()
    for entry in members:
        try:
            rates.add(inspect_audio(folder / entry.path).sample_rate_hz)
        except DataError:
            continue  # an unreadable recording is imported as it is, and named by `validate`
    return rates
