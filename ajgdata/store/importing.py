"""Import of recordings into sessions. Audio is copied or referenced, and not altered.

Rows of a session and files of the folder are matched by sha256, then by path. If they differ,
`OnChange` decides which of them is used.
"""

from __future__ import annotations

import math
import os
import re
import shutil
from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ajgdata.paths import AUDIO_FOLDER, EXCITATION_FILE, RECORDINGS_FILE, SESSION_FILE, Paths
from ajgdata.store.audio import AudioInfo, file_sha256
from ajgdata.store.changes import read_changes
from ajgdata.store.counters import canonical, grasp_key
from ajgdata.store.files import copy as copy_file
from ajgdata.store.folder_comparison import FolderComparison, StoredFile, compare_folder
from ajgdata.store.provenance import software
from ajgdata.store.scan import Remarks, Scan, ScannedFile, file_id, search
from ajgdata.store.session_names import KnownSession, stored_session_names
from ajgdata.store.sessions import (
    inside,
    list_sessions,
    read_session,
    read_table,
    write_session,
)
from ajgdata.types import WHOLE_FILE, DataError, Excitation, OnChange, Recording, Session, describe
from ajgdata.types.shell import shell_quoted

#: Digits of the sha256 in the name of a copy whose path another recording has.
DIGEST_DIGITS = 12
#: Columns of recordings.csv that a folder specifies, in addition to the labels.
CELLS = ("grasp_id", "placement_id", "sample", "object", "quality")
#: sha256 and header of each file; None if it is not usable audio.
Contents = dict[Path, tuple[str, AudioInfo | None]]
OTHER_BYTES = (
    "has different bytes in the folder. If these are other recordings, import them with --session; "
    "--on-change files takes them"
)
SEVERAL_FOLDERS = (
    "the session has recordings of several folders, so nothing of it is replaced. If this is "
    "another recording or sound, import its folder with another --session"
)
OTHER_TIMES = (
    "has other times in the folder. If the label track or table was corrected, --on-change files"
    " takes the times; else import the folder with --session"
)
OTHER_LABEL = "stays; --on-change labels takes the folder's"
BY_HAND = "stays, because a person set it; `ajgdata label NAME RECORDING --undo` takes it back"
OTHER_SOUND = (
    "decisions about the replaced file no longer count; repeat them for this file (`ajgdata label`)"
)
OTHER_PLAYED = (
    "the played sound is not the stored sound of the session. If these are recordings of another "
    "sound, import them with --session; --on-change files takes this sound"
)
STILL_THERE = (
    "stays, because its file is in the folder although this --pattern or --table does not read it. "
    "To remove it, move the file out of the folder"
)
OTHER_FOLDER = "is not in this folder, but may be in another folder. The recording stays"
GONE = "no longer in the folder; --on-change prune removes it here, if all files can be read"


@dataclass
class Imported:
    """Counts of one import, and remarks: names and reasons by type.

    - `failed`: files that could not be read
    - `unreadable`: recordings that were imported, but are not usable audio
    - `kept`: recordings with different bytes in the folder
    - `label`: labels that differ from the labels of the folder
    - `gone`: recordings without a file in the folder
    - `channels`: recordings with another number of channels than other files
    - `unused`: parts of the file names that vary and are not in the pattern
    - `not used`: files of the folder that are not recordings
    - `warning` and `note`: other remarks
    """

    sessions: int = 0
    added: int = 0
    changed: int = 0
    unchanged: int = 0
    removed: int = 0
    remarks: Remarks = field(default_factory=lambda: defaultdict(list))

    @property
    def is_complete(self) -> bool:
        """True if everything that belongs to the data set, by name or table, is imported, and no
        remark is a warning."""
        remark_types = ("failed", "unreadable", "kept", "channels", "unused", "warning")
        return not any(self.remarks[remark_type] for remark_type in remark_types)


def are_simulated(scanned: Scan, contents: Contents) -> bool:
    """Return True if the comments in the files begin with *simulated*.

    Raises DataError if this is so for a part of the files.
    """
    comments = {path: info.comment for path, (_, info) in contents.items() if info}
    simulated = [
        path.as_posix()
        for path, comment in comments.items()
        if comment.lower().startswith("simulated")
    ]
    if 0 < len(simulated) < len(comments):
        problem = f"{len(simulated)} of {len(comments)} files are simulated, e.g. {simulated[0]}"
        fix = "move them to another folder and import that folder into a data set of its own"
        raise DataError(scanned.folder, problem, fix)
    if simulated:
        scanned.remarks["note"].append(("simulated", "the comments in the files state this"))
    return bool(simulated)


def known_sessions(paths: Paths, dataset: str) -> dict[str, KnownSession]:
    """Return the sessions of a data set by name.

    The table of a session is read if its text is unknown. A session whose files cannot be read has
    no text and no recordings.
    """
    known = {}
    for name in list_sessions(paths, dataset):
        folder = paths.session(dataset, name)
        text = None
        files: frozenset[str] = frozenset()
        with suppress(DataError):
            session = read_session(folder)
            text = session.imported_as
            if text is None:
                is_copy = session.audio_root is None
                paths_in_folder = (
                    original_path(row.file, is_copy=is_copy) for row in read_table(folder)[0]
                )
                files = frozenset(path.as_posix() for path in paths_in_folder)
        known[name] = KnownSession(text, files)
    return known


def original_path(file: str, *, is_copy: bool) -> Path:
    """Return the path in the imported folder of the `file` of a recording, which can be a copy.

    >>> original_path("audio/wav/1.wav", is_copy=True).as_posix()
    'wav/1.wav'
    >>> original_path("audio/1~0123456789ab.wav", is_copy=True).as_posix()
    '1.wav'
    >>> original_path("audio/wav/1.wav", is_copy=False).as_posix()
    'audio/wav/1.wav'
    """
    path = Path(file)
    if not (is_copy and path.parts[0] == AUDIO_FOLDER):
        return path
    name = re.sub(rf"~[0-9a-f]{{{DIGEST_DIGITS}}}(?=\.[^.]*$)", "", path.name)
    return path.with_name(name).relative_to(AUDIO_FOLDER)


def import_sessions(
    paths: Paths,
    dataset: str,
    scanned: Scan,
    contents: Contents,
    copy: bool,
    on_change: OnChange,
    *,
    is_named: bool,
) -> Imported:
    """Write the sessions of `scanned` into `dataset`.

    If the user named the session (`is_named`), it can get the recordings of another folder, and no
    recording of the session is pruned from then on. A file that is not in `contents` could not be
    read, and is not imported. Raises DataError, before the first change, for a session that cannot
    get recordings of this folder.
    """
    result = Imported(remarks=scanned.remarks)
    files = defaultdict(list)
    for file in scanned.files:
        files[file.session].append(file)
    sessions = [
        _SessionImport(paths.session(dataset, name), replace(scanned, files=own), copy, on_change)
        for name, own in sorted(files.items())
    ]
    for session in sessions:
        session.check_folder(contents, is_named=is_named, is_only=len(sessions) == 1)
    for session in sessions:
        session.run(contents, result)
    return result


class _SessionImport:
    """Import of one folder into one session."""

    def __init__(self, target: Path, scanned: Scan, copy: bool, on_change: OnChange) -> None:
        self.target = target
        self.folder = scanned.folder
        self.files = scanned.files
        self.copy = copy
        self.on_change = on_change
        self.remarks = scanned.remarks
        self.played = scanned.played.get(target.name, [])
        root = None if copy else str(self.folder.absolute())
        new = _new_session(target, scanned, root)
        has_session = (target / SESSION_FILE).is_file()
        #: session.yaml of the session.
        self.declared = read_session(target) if has_session else new
        #: Rows of the session by recording_id.
        self.rows = session_rows(target)
        #: Labels that people set, which count instead of those of the rows.
        self.changes = read_changes(target)
        self.known_grasps = known_grasps(self.rows.values())
        self.original_files = {row.file: row.sha256 for row in self.rows.values()}
        #: Files that this import has copied.
        self.copied: set[str] = set()
        self.session_template = scanned.session_template
        self.is_only_folder = not self.declared.has_several_folders
        if self.declared.source != new.source or self.declared.audio_root != root:
            place = "with copies of its recordings"
            if self.declared.audio_root:
                place = f"its recordings are in {self.declared.audio_root}"
            problem = f"this session's source is {self.declared.source}, {place}"
            raise DataError(target, problem, "import the same way, or with another --session")

    def check_folder(self, contents: Contents, *, is_named: bool, is_only: bool) -> None:
        """Raise DataError if the folder has new recordings and few recordings of the session.

        Folders of two days can have the same name, and even the same names of files. `is_only` is
        True if the folder has no other session.
        """
        files = {file.path: contents[file.path][0] for file in self.files if file.path in contents}
        is_reference = self.declared.audio_root is not None
        if not self.rows or not files or is_reference:
            return
        compared = self._compared(files, contents)
        if compared.is_other_folder:
            self.is_only_folder = False
        if not compared.new:
            return
        if is_named:
            if compared.is_other_folder or compared.gone:
                self.is_only_folder = False
                self.declared = self.declared.model_copy(update={"has_several_folders": True})
            return
        takes_edited = bool(compared.edited) and self.on_change == OnChange.FILES
        has_several = self.declared.has_several_folders
        is_other = compared.has_mostly_other_files if has_several else compared.is_other_folder
        if not is_other or (takes_edited and not has_several):
            return
        missing = len(compared.edited) + len(compared.gone)
        shared = len(set(files.values()) & {row.sha256 for row in self.rows.values()})
        problem = (
            f"session {self.target.name!r} has {missing} recordings from another folder, and"
            f" {shared or 'none'} of the {len(files)} files of {self.folder}"
        )
        proposed = self._proposed_session(set(files.values()), is_only=is_only)
        fix = f"import the folder with --session {shell_quoted(proposed)}"
        if compared.edited and not has_several:
            fix += f"; if its files were edited (e.g. {compared.edited[0].as_posix()!r}), use "
            fix += "--on-change files"
        elif is_only:
            text = self.declared.imported_as or self.target.name
            fix += f" (--session {shell_quoted(text)} adds it to this session)"
        raise DataError(self.target, problem, fix)

    def _compared(self, files: Mapping[Path, str], contents: Contents) -> FolderComparison:
        """Return how the folder differs from the session.

        Files that the pattern or table does not read are compared only if recordings seem to be
        edited, or to be replaced by new files.
        """
        files_of_rows = (StoredFile(self._original(row), row.sha256) for row in self.rows.values())
        stored = list(dict.fromkeys(files_of_rows))
        paths = {item.path for item in stored if (self.folder / item.path).is_file()}
        digests = {digest for digest, _ in contents.values()}
        compared = compare_folder(stored, files, paths, digests)
        if compared.edited or (compared.new and compared.gone):
            digests |= self._unused_digests(contents)
            compared = compare_folder(stored, files, paths, digests)
        return compared

    def _proposed_session(self, digests: set[str], *, is_only: bool) -> str:
        """Return a session for the folder, whose files have `digests`, or its template.

        It is a session that has more of the files than this session. Without one, it is a new
        name that begins with the name of the parent folder.
        """
        parent = self.folder.resolve().parent.name or "new"
        if self.session_template and not is_only:
            return f"{parent} {self.session_template}"
        shared: dict[str, int] = {}
        for folder in sorted(self.target.parent.iterdir()):
            shared[folder.name] = 0
            with suppress(DataError):
                recordings, _ = read_table(folder)
                shared[folder.name] = len({row.sha256 for row in recordings} & digests)
        best = max(shared, key=lambda name: shared[name])
        if shared[best] > shared[self.target.name]:
            with suppress(DataError):
                return read_session(self.target.with_name(best)).imported_as or best
        names = [parent, f"{parent}_{self.target.name}"]
        names += [f"{parent}_{self.target.name}_{number}" for number in range(2, len(shared) + 3)]
        return next(name for name in names if stored_session_names([name])[name] not in shared)

    def run(self, contents: Contents, result: Imported) -> None:
        """Import the files of this session. After an error, the table has all copied files."""
        result.sessions += 1
        try:
            names = self._matched(contents)
            for file, name in names:
                self._take(file, name, contents[file.path][0], result)
            pruned = self._prune(names, contents)
            result.removed += len(pruned)
            self._set_sample_rate([contents[file.path][1] for file, _ in names])
            self._take_played()
        finally:
            if self.rows:
                if self.copy:
                    os.sync()  # the audio is on the disk before a table names it
                rows = sorted(self.rows.values(), key=lambda row: row.recording_id)
                write_session(self.target, self.declared, rows)
        if self.copy:
            remaining = {row.file for row in self.rows.values()}
            for file_name in set(pruned) - remaining:
                (self.target / file_name).unlink(missing_ok=True)

    def _prune(self, names: Sequence[tuple[ScannedFile, str]], contents: Contents) -> list[str]:
        """Remove the rows without a file in the folder if the user requires it, else list them.

        `names` are the imported files with the recording_id of their rows. Return the files of the
        removed rows.
        """
        unmatched = sorted(set(self.rows) - {name for _, name in names})
        imported = {file.path for file, _ in names}
        gone = [name for name in unmatched if not self._is_in_folder(name, imported)]
        if gone and self.on_change == OnChange.PRUNE:
            renamed = self._unused_digests(contents)
            gone = [name for name in gone if self.rows[name].sha256 not in renamed]
        unread = sorted(set(unmatched) - set(gone))
        self.remarks["warning"] += [(name, STILL_THERE) for name in unread]
        if not self.is_only_folder:
            self.remarks["gone"] += [(name, OTHER_FOLDER) for name in gone]
            return []
        if self.on_change != OnChange.PRUNE or self.remarks["failed"]:
            self.remarks["gone"] += [(name, GONE) for name in gone]
            return []
        return [self.rows.pop(name).file for name in gone]

    def _set_sample_rate(self, infos: Iterable[AudioInfo | None]) -> None:
        """Declare the sample rate of the session and of imported files; None for several rates."""
        rates = {info.sample_rate_hz for info in infos if info}
        if self.declared.sample_rate_hz is not None:
            rates.add(self.declared.sample_rate_hz)
        rate = rates.pop() if len(rates) == 1 else None
        self.declared = self.declared.model_copy(update={"sample_rate_hz": rate})

    @property
    def _takes_files(self) -> bool:
        """True if files of the folder replace stored files of their paths.

        In a session of several folders, a path can name recordings of two days.
        """
        return self.on_change == OnChange.FILES and not self.declared.has_several_folders

    def _original(self, row: Recording) -> Path:
        """Return the path of a recording in the imported folder."""
        return original_path(row.file, is_copy=self.copy)

    def _is_in_folder(self, name: str, imported: Collection[Path]) -> bool:
        """Return True if the file of a row is in the folder, and not `imported` for another row."""
        path = self._original(self.rows[name])
        return path not in imported and (self.folder / path).is_file()

    def _unused_digests(self, contents: Contents) -> set[str]:
        """Return the sha256 of the audio files of the folder that are readable and not imported."""
        digests = set()
        for path in set(search(self.folder)[0]) - set(contents):
            with suppress(DataError):
                digests.add(file_sha256(self.folder / path))
        return digests

    def _matched(self, contents: Contents) -> list[tuple[ScannedFile, str]]:
        """Return each readable file with the recording_id of its row.

        It is the row with the sha256 and segment of the file (and its path, if there are several),
        else the row with its path and segment or recording_id, else a new row.
        """
        by_file = {(row.file, row.segment): name for name, row in self.rows.items()}
        by_digest: dict[str, list[str]] = defaultdict(list)
        for name, row in sorted(self.rows.items()):
            by_digest[row.sound_id].append(name)
        matches = []
        for file in self.files:
            if file.path in contents:
                same_bytes = by_digest[file.segment.sound_id(contents[file.path][0])]
                same_path = by_file.get((self._file_name(file.path), file.segment), "")
                if same_path in same_bytes:
                    step = 0
                    ids = [same_path]
                else:
                    step = 1 if same_bytes else 2
                    ids = [*same_bytes, same_path]
                matches.append((step, [*ids, file.cells["recording_id"]], file))
        free = set(self.rows)
        used = set(self.rows)
        names = []
        for _, ids, file in sorted(matches, key=lambda match: match[0]):
            name = next((name for name in ids if name in free), "") or new_id(file, used)
            free.discard(name)
            used.add(name)
            names.append((file, name))
        return names

    def _file_name(self, path: Path) -> str:
        """Return `file` of a new row: the path in the folder, or below audio/ for a copy."""
        name = path.as_posix()
        if self.copy:
            return f"{AUDIO_FOLDER}/{name}"
        return name if name == name.strip() else f"./{name}"  # a cell loses blanks at its ends

    def _take(self, file: ScannedFile, name: str, digest: str, result: Imported) -> None:
        """Import one file as the recording `name`, or list the reason why it is not imported."""
        old = self.rows.get(name)
        if old and old.sha256 != digest and not self._takes_files:
            reason = OTHER_BYTES
            if self.declared.has_several_folders:
                reason = f"has different bytes in the folder, and {SEVERAL_FOLDERS}"
            self.remarks["kept"].append((name, reason))
            return
        if old and old.segment != file.segment and not self._takes_files:
            self.remarks["kept"].append((name, OTHER_TIMES))
            return
        if old and old.sha256 != digest and self.changes.active(name, old.sha256):
            self.remarks["warning"].append((name, OTHER_SOUND))
        try:
            new = self._row(file, name, digest)
        except ValidationError as error:
            problem = describe(error, file.path)
            self.remarks["failed"].append((problem.where, f"{problem.problem}; {problem.fix}"))
            return
        is_stored = self.original_files.get(new.file) == digest
        if self.copy and not (is_stored and (self.target / new.file).is_file()):
            self._copy(file.path, new.file)
        if old:
            has_quality = bool(file.cells["quality"])
            by_hand = self.changes.cells(name, digest)
            new = merged_row(
                old, new, by_hand, self.on_change, self.remarks, has_quality=has_quality
            )
        self.rows[name] = new
        if old is None:
            result.added += 1
        elif old == new:
            result.unchanged += 1
        else:
            result.changed += 1

    def _row(self, file: ScannedFile, name: str, digest: str) -> Recording:
        """Return the row of a file. Raises ValidationError for invalid cells."""
        target = self._file_name(file.path)
        if self.copy and name in self.rows:
            target = self.rows[name].file
        elif self.copy and self.original_files.get(target, digest) != digest:  # it was moved
            target = f"{Path(target).with_suffix('')}~{digest[:DIGEST_DIGITS]}{file.path.suffix}"
        cells = row_cells(file, self.known_grasps)
        values: dict[str, Any] = {
            "recording_id": name,
            "file": target,
            "sha256": digest,
            "labels": file.labels,
        }
        if file.segment != WHOLE_FILE:
            values["start_s"] = file.segment.start_s
            if not math.isinf(file.segment.end_s):
                values["end_s"] = file.segment.end_s
        return Recording.model_validate(cells | values)

    def _copy(self, path: Path, file: str) -> None:
        """Copy a file of the folder to `file` of the session, in one step, once per import."""
        if file in self.copied:
            return
        self.copied.add(file)
        destination = inside(self.target, file)
        temporary = self.target / AUDIO_FOLDER / ".copying"
        destination.parent.mkdir(parents=True, exist_ok=True)
        try:
            shutil.copyfile(self.folder / path, temporary)
            temporary.replace(destination)
        finally:
            temporary.unlink(missing_ok=True)

    def _take_played(self) -> None:
        """Store the played sound of the session, or list the reason why it is not stored.

        It is also copied with `--reference`, because session.yaml names a file of its own folder.
        """
        if len(self.played) > 1:
            names = ", ".join(path.as_posix() for path in self.played)
            self.remarks["kept"].append((names, "are several played sounds of one session"))
        if len(self.played) != 1:
            return
        (path,) = self.played
        digest = file_sha256(self.folder / path)
        known = self.declared.excitation
        if known and known.sha256 == digest and inside(self.target, known.file).is_file():
            return
        if known and not self._takes_files:
            reason = OTHER_PLAYED
            if self.declared.has_several_folders:
                reason = f"is not the stored played sound, and {SEVERAL_FOLDERS}"
            self.remarks["kept"].append((path.as_posix(), reason))
            return
        file = Path(EXCITATION_FILE).with_suffix(path.suffix.lower()).name
        copy_file(self.folder / path, self.target / file)
        played = Excitation(file=file, sha256=digest, description=f"imported from {path.name}")
        self.declared = self.declared.model_copy(update={"excitation": played})


def merged_row(
    old: Recording,
    new: Recording,
    by_hand: Mapping[str, str],
    on_change: OnChange,
    remarks: Remarks,
    *,
    has_quality: bool,
) -> Recording:
    """Return the row `new` of a recording with the cells of its `old` row, and with new columns.

    It has the cells of the folder if `on_change` requires it; if not, cells that differ are
    listed in `remarks`. Labels that people set (`by_hand`) are listed instead if they differ.
    `has_quality` is True if the folder specifies the quality.
    """
    columns = [column for column in CELLS if has_quality or column != "quality"]
    cells = {**old.labels, **{column: getattr(old, column) for column in CELLS}}
    offered = {**new.labels, **{column: getattr(new, column) for column in columns}}
    for column, text in offered.items():
        label = by_hand.get(column, text)
        if label != text:
            difference = f"{column} {label!r} here, {text!r} in the folder"
            remarks["label"].append((f"{old.recording_id}: {difference}", BY_HAND))
        if cells.setdefault(column, text) == text:
            continue
        if on_change == OnChange.LABELS:
            cells[column] = text
        elif column not in by_hand:
            difference = f"{column} {cells[column]!r} here, {text!r} in the folder"
            remarks["label"].append((f"{old.recording_id}: {difference}", OTHER_LABEL))
    labels = {column: text for column, text in cells.items() if column not in CELLS}
    return new.model_copy(update={**{name: cells[name] for name in CELLS}, "labels": labels})


def known_grasps(rows: Iterable[Recording]) -> dict[tuple[str, ...], str]:
    """Return the spelling of each grasp of a session: the canonical one if there are several."""
    spellings = {row.grasp_id for row in rows}
    canonical_last = sorted(spellings, key=lambda text: ("/".join(grasp_key(text)) == text, text))
    return {grasp_key(text): text for text in canonical_last}


def row_cells(file: ScannedFile, grasps: Mapping[tuple[str, ...], str]) -> dict[str, str]:
    """Return the cells of a recording; `grasps` are the known spellings of the session."""
    defaults = {"sample": "0", "quality": "ok"}
    cells = {column: file.cells[column] or defaults.get(column, "") for column in CELLS}
    if file.has_grasp:
        grasp = cells["grasp_id"]
        key = grasp_key(grasp) if file.has_grasp_parts else (canonical(grasp),)
        cells["grasp_id"] = grasps.get(key, grasp)
    return cells


def new_id(file: ScannedFile, used: Collection[str]) -> str:
    """Return the id in the table, else the path without suffix; it is numbered if it is used."""
    plain = file.cells["recording_id"] or file_id(file.path)
    name = plain
    count = 1
    while name in used:
        count += 1
        name = f"{plain}_{count}"
    return name


def _new_session(target: Path, scanned: Scan, root: str | None) -> Session:
    """Return session.yaml of a new session; `root` is the folder of referenced recordings."""
    return Session(
        session_id=target.name,
        source="virtual-import" if scanned.is_simulated else "import",
        imported_as=scanned.session_texts.get(target.name),
        audio_root=root,
        software=f"ajgdata {software()['ajgdata_version']}",
        notes=f"imported from a folder named {scanned.folder.name!r}",
    )


def session_rows(target: Path) -> dict[str, Recording]:
    """Return the rows of a session. Raises DataError for a table with errors."""
    if not (target / RECORDINGS_FILE).is_file():
        return {}
    recordings, issues = read_table(target)
    if issues:
        problem = f"{issues[0].problem}; nothing was imported into this session"
        raise DataError(target / RECORDINGS_FILE, problem, issues[0].fix)
    return {row.recording_id: row for row in recordings}
