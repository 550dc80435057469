"""Bring a folder of recordings in as sessions. Audio is copied or referenced, never altered; what
is not read as it is can be decoded into a new file."""

from __future__ import annotations

import os
import shutil
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ajgdata.paths import AUDIO_FOLDER, Paths
from ajgdata.store.audio import file_sha256, inspect_audio
from ajgdata.store.decoding import decoded
from ajgdata.store.files import remove_empty_folders, sha256_of, write_bytes
from ajgdata.store.import_record import Origin, cells_of, merged, with_cells
from ajgdata.store.import_rows import check_space, ids_of, recording_of
from ajgdata.store.imported_session import ImportedSession, open_sessions
from ajgdata.store.locks import own_folder
from ajgdata.store.scan import Scan, ScannedFile
from ajgdata.types import DataError, Recording

#: Column of a recording that was decoded: from which file, by what.
DECODED_FROM = "decoded_from"


@dataclass
class Imported:
    """Counts of one import, and by name what a person should know of it.

    `conflicts` are recordings whose bytes differ from those held; `corrected` labels that were
    changed here and are kept; `moved` files that have another path in the folder now; `gone`
    recordings whose file is no longer there, `pruned` such that were removed; `failed` files that
    could not be read or written, `unreadable` such that were imported though they are no audio that
    can be used, with the reason.
    """

    sessions: int = 0
    added: int = 0
    relabelled: int = 0
    unchanged: int = 0
    decoded: int = 0
    conflicts: list[str] = field(default_factory=list)
    corrected: list[str] = field(default_factory=list)
    moved: list[tuple[str, str]] = field(default_factory=list)
    gone: list[str] = field(default_factory=list)
    pruned: list[str] = field(default_factory=list)
    failed: list[tuple[str, str]] = field(default_factory=list)
    unreadable: list[tuple[str, str]] = field(default_factory=list)


@dataclass(frozen=True)
class How:
    """How an import treats audio and labels, see `import_scan`."""

    copy: bool
    replace: bool
    replace_labels: bool = False
    prune: bool = False


def import_scan(
    paths: Paths,
    dataset: str,
    folder: Path,
    scanned: Scan,
    how: How,
    *,
    progress: Callable[[], object] = lambda: None,
) -> Imported:
    """Write the sessions of `scanned` below `folder` into `dataset`.

    Running it again adds what is new and takes over labels that changed in the folder. It keeps
    labels that were changed here since (unless `replace_labels`), further columns, recordings that
    are no longer in the folder (unless `prune`, and all others could be read), and what was
    completed in session.yaml. A file that was moved in the folder keeps its recording, under its
    new name. A recording, or a played sound, whose bytes differ from those held is left alone and
    listed in `conflicts`, unless `replace`. A file that cannot be read is listed in `failed`,
    and nothing of it is written. Whatever ends it, each file that was written stands in its
    session's table. Raises DataError, before anything is written, for a session that cannot be
    added to.
    """
    names = {entry.session for entry in scanned.files}
    sessions = open_sessions(paths, dataset, folder, names, copy=how.copy)
    if how.copy:
        check_space(paths, folder, scanned, sessions)
    members_of = defaultdict(list)
    for entry in scanned.files:
        members_of[entry.session].append(entry)
    one = _Import(folder, how, sessions, Imported(sessions=len(names)))
    try:
        for name in sorted(names):
            members = members_of[name]
            played = scanned.excitations.get(name)
            for entry, recording_id in zip(members, ids_of(members, sessions[name]), strict=True):
                one.take(entry, recording_id)
                progress()
            if sessions[name].held:
                sources = {entry.path.as_posix() for entry in members}
                one.describe(sessions[name], sources, played)
        one.look_for_gone(prune=how.prune and not (scanned.missing or one.result.failed))
    finally:
        one.write()
    return one.result


class _Import:
    """One import: what it found so far, and what is to be removed once the tables are written."""

    def __init__(
        self,
        folder: Path,
        how: How,
        sessions: Mapping[str, ImportedSession],
        result: Imported,
    ) -> None:
        self.folder, self.how, self.sessions, self.result = folder, how, sessions, result
        self.root = str(folder.absolute())
        self.temporary: dict[Path, Path] = {}
        self.stack = ExitStack()
        self.obsolete: list[Path] = []
        self.unfinished: Path | None = None
        self.homeless = self._homeless()

    def _homeless(self) -> dict[str, list[tuple[ImportedSession, str]]]:
        """Return recordings whose file is no longer in the folder that they came from, by hash."""
        found: dict[str, list[tuple[ImportedSession, str]]] = defaultdict(list)
        for session in self.sessions.values():
            for name, origin in session.origins.items():
                is_here = origin.folder == self.root and name in session.held
                if is_here and _is_gone(self.folder / origin.source):
                    found[origin.sha256].append((session, name))
        return found

    def take(self, entry: ScannedFile, recording_id: str) -> None:
        """Bring one file in, or say why not."""
        try:
            self._take(entry, recording_id)
        except DataError as error:
            self._fail(entry.path, f"{error.problem}; {error.fix}")
        except OSError as error:
            self._fail(entry.path, f"cannot be read or written ({error.strerror})")

    def _fail(self, path: Path, reason: str) -> None:
        """Say why a file was not brought in, of which nothing is left."""
        self.result.failed.append((path.as_posix(), reason))
        if self.unfinished:
            self.unfinished.unlink(missing_ok=True)
            remove_empty_folders(self.unfinished.parent)
        self.unfinished = None

    def _take(self, entry: ScannedFile, recording_id: str) -> None:
        session = self.sessions[entry.session]
        digest = file_sha256(self.folder / entry.path)
        self._compare_identity(entry, recording_id, digest)
        recording = recording_of(self.folder, entry, recording_id, copy=self.how.copy)
        old, before = session.held.get(recording_id), session.before(recording_id)
        moved_from = None if old else next(iter(self.homeless.get(digest, ())), None)
        if moved_from:
            old, before = moved_from[0].held[moved_from[1]], moved_from[0].before(moved_from[1])
        elif old and session.origin_sha256(recording_id) != digest and not self.how.replace:
            self.result.conflicts.append(recording_id)
            self.homeless.pop(digest, None)  # those bytes are in the folder, under a taken name
            return
        found = {**cells_of(recording), "quality": recording.quality or "ok"}
        if old:
            recording = self._with_labels(recording, old, before)
        recording = self._with_audio(entry, session, recording, digest)
        if moved_from:
            self.homeless[digest].remove(moved_from)
            self._forget(*moved_from)
            session.take_over(moved_from[0])
            self.result.moved.append((moved_from[1], recording_id))
        last = session.origins.get(recording_id)
        same = old is not None and last is not None and old.sha256 == recording.sha256
        session.held[recording_id] = recording
        session.origins[recording_id] = Origin(
            folder=self.root,
            source=entry.path.as_posix(),
            sha256=digest,
            cells=found,
            sample_rate_hz=last.sample_rate_hz if last and same else 0,
        )
        self.unfinished = None
        if old is None:
            self.result.added += 1
        elif old != recording:
            self.result.relabelled += 1
        else:
            self.result.unchanged += 1

    def _compare_identity(self, entry: ScannedFile, recording_id: str, digest: str) -> None:
        """Raise DataError if the table has another hash; list another recording_id."""
        if entry.sha256 not in ("", digest):
            raise DataError(entry.path, "its sha256 is not that of the table", "restore the file")
        if entry.recording_id and entry.recording_id != recording_id:
            difference = f"recording_id {recording_id!r} here, {entry.recording_id!r} in the folder"
            self.result.corrected.append(f"{recording_id}: {difference}")

    def _with_labels(
        self, recording: Recording, old: Recording, before: dict[str, str] | None
    ) -> Recording:
        """Return the recording with what people corrected and added since the last import."""
        found, here = cells_of(recording), cells_of(old)
        if not recording.quality:
            found.pop("quality")  # the folder does not tell
        if self.how.replace_labels:
            return with_cells(recording, {**here, **found})
        cells, kept = merged(here, found, before)
        self.result.corrected += [f"{recording.recording_id}: {one}" for one in kept]
        return with_cells(recording, cells)

    def _with_audio(
        self,
        entry: ScannedFile,
        session: ImportedSession,
        recording: Recording,
        digest: str,
    ) -> Recording:
        """Return the recording with its hash, its file being where it shall be."""
        quality = recording.quality or "ok"
        recording = recording.model_copy(update={"quality": quality, "sha256": digest})
        destination = session.folder / recording.file
        if self.how.copy and not destination.exists():
            self.unfinished = destination
        if entry.decode:
            return self._with_decoded(entry, destination, recording, session)
        if self.how.copy and not self._holds(destination, digest):
            self._copy(self.folder / entry.path, destination, session)
        return recording

    def _copy(self, source: Path, destination: Path, session: ImportedSession) -> None:
        """Copy a file and rename the copy. All copies of a session share a temporary folder: one
        for each would cost more than the copies."""
        audio = session.folder / AUDIO_FOLDER
        if audio not in self.temporary:
            audio.parent.mkdir(parents=True, exist_ok=True)
            self.temporary[audio] = self.stack.enter_context(own_folder(audio))
        temporary = self.temporary[audio] / "copy"
        shutil.copyfile(source, temporary)
        destination.parent.mkdir(parents=True, exist_ok=True)
        temporary.replace(destination)

    def _with_decoded(
        self, entry: ScannedFile, destination: Path, recording: Recording, session: ImportedSession
    ) -> Recording:
        """Return a recording with the hash of its decoded file, which is made where it is not."""
        known = session.held.get(recording.recording_id)
        same = session.origin_sha256(recording.recording_id) == recording.sha256
        if known and same and self._holds(destination, known.sha256):
            labels = {**recording.labels, DECODED_FROM: known.labels.get(DECODED_FROM, "")}
            return recording.model_copy(update={"sha256": known.sha256, "labels": labels})
        content, made_by = decoded(self.folder / entry.path)
        write_bytes(destination, content)
        self.result.decoded += 1
        labels = {**recording.labels, DECODED_FROM: f"{entry.path.name} ({made_by})"}
        return recording.model_copy(update={"sha256": sha256_of(content), "labels": labels})

    def _holds(self, path: Path, digest: str) -> bool:
        return path.is_file() and file_sha256(path) == digest

    def _forget(self, session: ImportedSession, recording_id: str) -> None:
        """Take a recording out of its session; its copy goes once the tables are written."""
        recording = session.held.pop(recording_id)
        session.is_emptied = not session.held
        session.origins.pop(recording_id, None)
        if self.how.copy:
            self.obsolete.append(session.folder / recording.file)

    def look_for_gone(self, *, prune: bool) -> None:
        """List, or remove, recordings whose file is no longer in the folder."""
        left = [one for found in self.homeless.values() for one in found]
        for session, name in sorted(left, key=lambda one: one[1]):
            if prune:
                self._forget(session, name)
            (self.result.pruned if prune else self.result.gone).append(name)

    def describe(
        self, session: ImportedSession, sources: Collection[str], played: Path | None
    ) -> None:
        """Complete what session.yaml says of rate and played sound."""
        before = session.declared.sample_rate_hz if session.is_old else None
        base = session.folder if self.how.copy else self.folder
        names = [name for name in session.held if session.source(name) in sources]
        rates = {before} - {None} | self._rates(session, base, names)
        changed: dict[str, Any] = {"sample_rate_hz": rates.pop() if len(rates) == 1 else None}
        session.declared = session.declared.model_copy(update=changed)
        if played is None:
            return
        try:
            if not session.take_played(self.folder / played, replace=self.how.replace):
                self.result.conflicts.append(f"{played.as_posix()}, the played sound")
        except OSError as error:
            reason = f"the played sound cannot be read or written ({error.strerror})"
            self._fail(played, reason)

    def _rates(self, session: ImportedSession, base: Path, names: Iterable[str]) -> set[int]:
        """Return the rates of recordings, of which those that are not known are looked at; what
        cannot be read is imported as it is, and said each time."""
        rates = set()
        for name in names:
            origin, file = session.origins.get(name), base / session.held[name].file
            rate = origin.sample_rate_hz if origin else 0
            try:
                rate = rate or inspect_audio(file).sample_rate_hz
            except DataError as error:
                self.result.unreadable.append((file.name, error.problem))
                continue
            rates.add(rate)
            if origin and origin.sample_rate_hz != rate:
                found = {"sample_rate_hz": rate}
                session.origins[name] = origin.model_copy(update=found)
        return rates

    def write(self) -> None:
        """Write every session that holds something, then remove the copies of moved recordings."""
        if self.unfinished:  # its row is not in the table
            self.unfinished.unlink(missing_ok=True)
            remove_empty_folders(self.unfinished.parent)
        self.stack.close()
        if self.temporary:
            os.sync()  # the audio is on the disk before a table names it
        for session in self.sessions.values():
            if session.held:
                session.write()
        needed = {s.folder / one.file for s in self.sessions.values() for one in s.held.values()}
        for path in set(self.obsolete) - needed:
            path.unlink(missing_ok=True)
            remove_empty_folders(path.parent)
        for session in self.sessions.values():
            if not session.held and (session.is_emptied or not session.is_old):
                session.remove()


def _is_gone(path: Path) -> bool:
    """Return True if no such name is there: a link that leads nowhere is, and what may not be
    looked at may be."""
    try:
        path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return True
    except OSError:
        return False
    return False
