"""Bring a folder of recordings in as sessions. Audio is copied or referenced, never altered.

Rows of a session and files of the folder are matched by sha256, then by path. Where they differ,
`OnChange` decides which of them holds.
"""

from __future__ import annotations

import os
import shutil
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from pydantic import ValidationError

from ajgdata.paths import AUDIO_FOLDER, EXCITATION_FILE, RECORDINGS_FILE, SESSION_FILE, Paths
from ajgdata.store.audio import file_sha256, inspect_audio
from ajgdata.store.files import remove_empty_folders, write_bytes
from ajgdata.store.provenance import software
from ajgdata.store.scan import Scan, ScannedFile
from ajgdata.store.sessions import inside, read_recordings, read_session, write_session
from ajgdata.types import DataError, Excitation, OnChange, Recording, Session, describe

#: Columns of recordings.csv that a folder tells, in addition to the labels.
_TOLD = ("grasp_id", "sample", "object", "quality")


@dataclass
class Imported:
    """Counts of one import, and the recordings or files that need attention.

    `conflicts` are recordings with different bytes in the folder, `differing` labels that differ
    from the folder's, `gone` recordings without a file in the folder. `failed` are files that could
    not be read or written, `unreadable` recordings that were imported but are not usable audio.
    """

    sessions: int = 0
    added: int = 0
    changed: int = 0
    unchanged: int = 0
    removed: int = 0
    conflicts: list[str] = field(default_factory=list)
    differing: list[str] = field(default_factory=list)
    gone: list[str] = field(default_factory=list)
    failed: list[tuple[str, str]] = field(default_factory=list)
    unreadable: list[tuple[str, str]] = field(default_factory=list)


def import_scan(
    paths: Paths,
    dataset: str,
    folder: Path,
    scanned: Scan,
    *,
    copy: bool,
    on_change: OnChange = OnChange.KEEP,
    progress: Callable[[], object] = lambda: None,
) -> Imported:
    """Write the sessions of `scanned` below `folder` into `dataset`.

    Running it again adds what is new, and leaves every row, file and session.yaml unchanged, unless
    `on_change` takes the folder's files or labels, or removes recordings that are gone from the
    folder. A recording with a known sha256 is the same recording, even if its file was moved. A
    file that cannot be read is listed in `failed`, and nothing of it is written. Whatever ends the
    import, each file that was written is in its session's table. Raises DataError, before anything
    is written, for a session that cannot be added to.
    """
    members: dict[str, list[ScannedFile]] = defaultdict(list)
    for entry in scanned.files:
        members[entry.session].append(entry)
    result = Imported(sessions=len(members))
    sessions = {
        name: _SessionImport(paths.session(dataset, name), folder, copy, on_change, result)
        for name in sorted(members)
    }
    for name, session in sessions.items():
        try:
            session.take(members[name], progress)
            session.look_for_gone(prune=not scanned.missing)
            session.describe(scanned.excitations.get(name))
        finally:
            session.write()
    return result


class _SessionImport:
    """One session: its declaration, its rows by recording_id, and the folder that is imported."""

    def __init__(
        self, target: Path, folder: Path, copy: bool, on_change: OnChange, result: Imported
    ) -> None:
        self.target, self.folder, self.copy = target, folder, copy
        self.on_change, self.result = on_change, result
        root = None if copy else str(folder.absolute())
        is_old = (target / SESSION_FILE).is_file()
        self.declared = read_session(target) if is_old else _new_session(target, folder, root)
        self.rows = _rows_of(target)
        self.files = {row.file for row in self.rows.values()}
        self.taken: set[str] = set()
        self.obsolete: list[Path] = []
        if self.declared.source != "import" or self.declared.audio_root != root:
            held = self.declared.audio_root
            problem = f"this session's source is {self.declared.source}, "
            problem += f"its recordings are in {held}" if held else "with copies of its recordings"
            raise DataError(target, problem, "import the same way, or with another --session")

    def file_of(self, entry: ScannedFile) -> str:
        """Return `file` of a new row: the path in the folder, or below audio/ for a copy."""
        return f"{AUDIO_FOLDER}/{entry.path.as_posix()}" if self.copy else entry.path.as_posix()

    def take(self, members: Sequence[ScannedFile], progress: Callable[[], object]) -> None:
        """Bring the files of this session in, or list why not."""
        digests: dict[Path, str] = {}
        for entry in members:
            with self._reported(entry.path):
                digests[entry.path] = file_sha256(self.folder / entry.path)
        readable = [entry for entry in members if entry.path in digests]
        known = self._known(readable, digests)
        for entry in readable:
            name = known.get(entry.path) or self._new_id(entry)
            self.taken.add(name)
            with self._reported(entry.path):
                self._take(entry, name, digests[entry.path])
            progress()

    @contextmanager
    def _reported(self, path: Path) -> Iterator[None]:
        """List a file of the folder that cannot be brought in, with the reason."""
        try:
            yield
        except DataError as error:
            self.result.failed.append((path.as_posix(), f"{error.problem}; {error.fix}"))
        except OSError as error:
            reason = f"cannot be read or written ({error.strerror})"
            self.result.failed.append((path.as_posix(), reason))

    def _known(
        self, members: Sequence[ScannedFile], digests: Mapping[Path, str]
    ) -> dict[Path, str]:
        """Return the recording_id of the row of each known file: the row with its sha256 (with its
        path, too, if there are several), else the row with its path or recording_id."""
        by_file = {row.file: name for name, row in self.rows.items()}
        by_digest: dict[str, list[str]] = defaultdict(list)
        for name, row in sorted(self.rows.items()):
            by_digest[row.sha256].append(name)
        known, free = dict[Path, str](), set(self.rows)
        for step in ("same", "moved", "edited"):
            for entry in (one for one in members if one.path not in known):
                names, at = by_digest[digests[entry.path]], by_file.get(self.file_of(entry), "")
                if step == "same":
                    names = [at] if at in names else []
                elif step == "edited":
                    names = [at, entry.recording_id]
                if name := next((one for one in names if one in free), ""):
                    known[entry.path] = name
                    free.remove(name)
        return known

    def _new_id(self, entry: ScannedFile) -> str:
        """Return the id that a table gives, else the path without suffix; numbered if taken."""
        plain = entry.recording_id or entry.path.with_suffix("").as_posix()
        name, number = plain, 1
        while name in self.rows or name in self.taken:
            number += 1
            name = f"{plain}_{number}"
        return name

    def _take(self, entry: ScannedFile, name: str, digest: str) -> None:
        """Bring one file in as the recording `name`."""
        old = self.rows.get(name)
        if old and old.sha256 != digest and self.on_change != OnChange.FILES:
            self.result.conflicts.append(name)
            return
        new = self._row(entry, name, digest)
        is_there = old is not None and old.sha256 == digest and (self.target / old.file).is_file()
        if self.copy and not is_there:
            self._copy(entry.path, new.file)
        if old:
            new = self._merged(old, new, told_quality=bool(entry.quality))
        self.rows[name] = new
        self.result.added += old is None
        self.result.changed += old not in (None, new)
        self.result.unchanged += old == new

    def _row(self, entry: ScannedFile, name: str, digest: str) -> Recording:
        file = self.file_of(entry)
        if self.copy and name in self.rows:
            file = self.rows[name].file
        elif self.copy and file in self.files:  # of a file that was moved
            file = f"{Path(file).with_suffix('')}~{digest[:12]}{entry.path.suffix}"
        try:
            return Recording(
                recording_id=name,
                file=file,
                sha256=digest,
                grasp_id=entry.grasp,
                sample=entry.sample,
                object=entry.object,
                quality=entry.quality or "ok",
                labels=dict(entry.labels),
            )
        except ValidationError as error:
            raise describe(error, self.folder / entry.path) from None

    def _copy(self, path: Path, file: str) -> None:
        """Copy a file of the folder to `file` of the session."""
        destination = inside(self.target, file)
        temporary = self.target / AUDIO_FOLDER / ".copying"
        temporary.parent.mkdir(parents=True, exist_ok=True)
        try:
            shutil.copyfile(self.folder / path, temporary)
            destination.parent.mkdir(parents=True, exist_ok=True)
            temporary.replace(destination)
        finally:
            temporary.unlink(missing_ok=True)
            remove_empty_folders(destination.parent)

    def _merged(self, old: Recording, new: Recording, *, told_quality: bool) -> Recording:
        """Return the row here with new columns of the folder, and with the folder's cells if
        `on_change` takes them; otherwise cells that differ are listed."""
        told = [name for name in _TOLD if told_quality or name != "quality"]
        here = {**old.labels, **{name: getattr(old, name) for name in _TOLD}}
        found = {**new.labels, **{name: getattr(new, name) for name in told}}
        for column, text in found.items():
            if here.setdefault(column, text) == text:
                continue
            if self.on_change == OnChange.LABELS:
                here[column] = text
            else:
                difference = f"{column} {here[column]!r} here, {text!r} in the folder"
                self.result.differing.append(f"{old.recording_id}: {difference}")
        labels = {column: text for column, text in here.items() if column not in _TOLD}
        return new.model_copy(update={**{name: here[name] for name in _TOLD}, "labels": labels})

    def look_for_gone(self, *, prune: bool) -> None:
        """List the rows without a file in the folder, or remove them if that is requested and every
        file could be read."""
        gone = sorted(set(self.rows) - self.taken)
        if not (prune and self.on_change == OnChange.PRUNE) or self.result.failed:
            self.result.gone += gone
            return
        for name in gone:
            row = self.rows.pop(name)
            self.result.removed += 1
            if self.copy:
                self.obsolete.append(self.target / row.file)

    def describe(self, played: Path | None) -> None:
        """Complete what session.yaml says of rate and played sound."""
        base = self.target if self.copy else self.folder
        rates = {self.declared.sample_rate_hz} - {None}
        for name in sorted(self.taken & set(self.rows)):
            file = base / self.rows[name].file
            try:
                rates.add(inspect_audio(file).sample_rate_hz)
            except DataError as error:
                self.result.unreadable.append((file.name, error.problem))
        rate = {"sample_rate_hz": rates.pop() if len(rates) == 1 else None}
        self.declared = self.declared.model_copy(update=rate)
        if played and self.rows:
            with self._reported(played):
                self._take_played(played)

    def _take_played(self, played: Path) -> None:
        """Take the played sound of the folder, unless the session has another one."""
        digest, old = file_sha256(self.folder / played), self.declared.excitation
        if old and old.sha256 != digest and self.on_change != OnChange.FILES:
            self.result.conflicts.append(f"{played.as_posix()}, the played sound")
        elif old is None or old.sha256 != digest:
            write_bytes(self.target / EXCITATION_FILE, (self.folder / played).read_bytes())
            said = f"imported {played.name}"
            found = Excitation(file=EXCITATION_FILE, sha256=digest, description=said)
            self.declared = self.declared.model_copy(update={"excitation": found})

    def write(self) -> None:
        """Write table and declaration, if they changed, then remove the copies of removed rows."""
        if self.rows:
            os.sync()  # the audio is on the disk before a table names it
            rows = sorted(self.rows.values(), key=lambda row: row.recording_id)
            write_session(self.target, self.declared, rows)
        for path in self.obsolete:
            path.unlink(missing_ok=True)
            remove_empty_folders(path.parent)


def _new_session(target: Path, folder: Path, root: str | None) -> Session:
    return Session(
        session_id=target.name,
        source="import",
        audio_root=root,
        software=f"ajgdata {software()['ajgdata_version']}",
        notes=f"imported from a folder named {folder.name!r}",
    )


def _rows_of(target: Path) -> dict[str, Recording]:
    """Return the rows of a session. Raises DataError for a table with errors."""
    if not (target / RECORDINGS_FILE).is_file():
        return {}
    recordings, findings = read_recordings(target)
    if errors := [finding for finding in findings if finding.level == "error"]:
        problem = f"{errors[0].problem}; nothing was imported into this session"
        raise DataError(target / RECORDINGS_FILE, problem, errors[0].fix)
    return {row.recording_id: row for row in recordings}
