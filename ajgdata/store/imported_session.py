"""A session as an import finds it, changes it and writes it."""

from __future__ import annotations

import shutil
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path

from ajgdata.paths import (
    AUDIO_FOLDER,
    EXCITATION_FILE,
    IMPORT_FILE,
    RECORDINGS_FILE,
    SESSION_FILE,
    Paths,
)
from ajgdata.store.audio import file_sha256
from ajgdata.store.files import remove_empty_folders, replacing
from ajgdata.store.import_record import ImportRecord, Origin, read_record, write_record
from ajgdata.store.provenance import software
from ajgdata.store.sessions import (
    inside,
    list_sessions,
    read_recordings,
    read_session,
    write_session,
)
from ajgdata.types import DataError, Excitation, Recording, Session


@dataclass
class ImportedSession:
    """One session: its declaration, its recordings and where they came from, by recording_id.

    `is_old` says that it was on disk before, `is_emptied` that its last recording was taken out;
    `played` is the hash of the played sound that the last import found.
    """

    folder: Path
    declared: Session
    held: dict[str, Recording]
    origins: dict[str, Origin]
    is_old: bool
    is_emptied: bool = False
    played: str = ""
    _found: tuple[object, ...] = field(init=False)

    def __post_init__(self) -> None:
        """Keep what was there, by which a change is told."""
        self._found = self._content()

    def _content(self) -> tuple[object, ...]:
        return self.declared, dict(self.held), dict(self.origins), self.played

    def source(self, recording_id: str) -> str:
        """Return the path inside the folder from which a recording came."""
        if recording_id in self.origins:
            return self.origins[recording_id].source
        return self.held[recording_id].file.removeprefix(f"{AUDIO_FOLDER}/")

    def origin_sha256(self, recording_id: str) -> str:
        """Return the hash of the file from which a recording came, "" for an unknown recording.

        It is not the recording's own where that was decoded, or changed and sealed here.
        """
        if recording_id not in self.held:
            return ""
        origin = self.origins.get(recording_id)
        return origin.sha256 if origin else self.held[recording_id].sha256

    def before(self, recording_id: str) -> dict[str, str] | None:
        """Return what the last import found of a recording; None if that is not known."""
        origin = self.origins.get(recording_id)
        return dict(origin.cells) if origin else None

    def take_over(self, other: ImportedSession) -> None:
        """Take over what people said of a session whose recordings were moved to this new one."""
        if not self.is_old and other is not self:
            name = self.declared.session_id
            self.declared = other.declared.model_copy(update={"session_id": name})
            self.is_old, self.played = True, other.played
            if played := other.declared.excitation:
                file = inside(other.folder, played.file)
                if file.is_file():
                    _copy(file, self.folder / played.file)

    def take_played(self, source: Path, *, replace: bool) -> bool:
        """Take a played sound from the folder, and keep what people said of one that is known.

        Returns False, having changed nothing, for other bytes than those that the recordings here
        were made with, unless `replace`.
        """
        digest, old = file_sha256(source), self.declared.excitation
        known = old if old and digest == (self.played or old.sha256) else None
        if old and not known and not replace:
            return False
        if known is None or not inside(self.folder, known.file).is_file():
            _copy(source, self.folder / EXCITATION_FILE)
            said = known.description if known else f"imported {source.name}"
            found = Excitation(file=EXCITATION_FILE, sha256=digest, description=said)
            self.declared = self.declared.model_copy(update={"excitation": found})
        self.played = digest
        return True

    def write(self) -> None:
        """Write table, declaration and record, each if it changed."""
        if self.is_old and self._found == self._content():
            return  # the longest part of importing many files again
        rows = sorted(self.held.values(), key=lambda one: one.recording_id)
        write_session(self.folder, self.declared, rows)
        write_record(self.folder, ImportRecord(recordings=self.origins, played=self.played))

    def remove(self) -> None:
        """Remove what is left of a session without recordings."""
        for name in (RECORDINGS_FILE, SESSION_FILE, IMPORT_FILE, EXCITATION_FILE):
            (self.folder / name).unlink(missing_ok=True)
        remove_empty_folders(self.folder)


def open_sessions(
    paths: Paths, dataset: str, folder: Path, names: Collection[str], *, copy: bool
) -> dict[str, ImportedSession]:
    """Return the sessions `names`, and others that were imported from `folder` the same way before.

    Raises DataError for one that recordings cannot be added to.
    """
    sessions = {
        name: _opened(paths.session(dataset, name), folder, copy=copy) for name in sorted(names)
    }
    for name in list_sessions(paths, dataset):
        record = read_record(paths.session(dataset, name)) if name not in names else None
        origins = record.recordings.values() if record else ()
        if any(origin.folder == str(folder.absolute()) for origin in origins):
            target = paths.session(dataset, name)
            if _root(folder, copy=copy) == _declared_root(target):
                sessions[name] = _opened(target, folder, copy=copy)
    return sessions


def _root(folder: Path, *, copy: bool) -> str | None:
    """Return what session.yaml says of where the audio is."""
    return None if copy else str(folder.absolute())


def _declared_root(target: Path) -> str | None:
    return read_session(target).audio_root if (target / SESSION_FILE).is_file() else None


def _copy(source: Path, target: Path) -> None:
    with replacing(target) as temporary:
        shutil.copyfile(source, temporary)


def _opened(target: Path, folder: Path, *, copy: bool) -> ImportedSession:
    """Return a session as it was, after checking that recordings may be added to it."""
    root = _root(folder, copy=copy)
    held = _held(target)
    if not (target / SESSION_FILE).is_file():
        session = Session(
            session_id=target.name,
            source="import",
            audio_root=root,
            software=f"ajgdata {software()['ajgdata_version']}",
            notes=f"imported from a folder named {folder.name!r}",
        )
        return ImportedSession(target, session, held, {}, is_old=False)
    session = read_session(target)
    if session.source != "import":
        raise DataError(
            target, f"this session's source is {session.source}", "import with another --session"
        )
    if session.audio_root != root:
        how = f"references {session.audio_root}" if session.audio_root else "holds copies"
        raise DataError(
            target, f"this session {how}", "import the same way again, or with another --session"
        )
    record = read_record(target)
    origins = dict(record.recordings) if record else {}
    played = record.played if record else ""
    return ImportedSession(target, session, held, origins, is_old=True, played=played)


def _held(target: Path) -> dict[str, Recording]:
    if not (target / RECORDINGS_FILE).is_file():
        return {}
    recordings, findings = read_recordings(target)
    if errors := [finding for finding in findings if finding.level == "error"]:
        raise DataError(
            target / RECORDINGS_FILE,
            f"{errors[0].problem}; nothing was imported into this session",
            errors[0].fix,
        )
    return {r.recording_id: r for r in recordings}
