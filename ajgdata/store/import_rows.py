"""What an import is about to write: id and row of each file, and whether the disk can take it."""

from __future__ import annotations

import shutil
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from pydantic import ValidationError

from ajgdata.paths import AUDIO_FOLDER, Paths
from ajgdata.store.files import sha256_of
from ajgdata.store.imported_session import ImportedSession
from ajgdata.store.publishing.archive import bad_name
from ajgdata.store.scan import Scan, ScannedFile
from ajgdata.types import DataError, Recording, describe

LONGEST_ID = 200


def check_space(
    paths: Paths, folder: Path, scanned: Scan, sessions: Mapping[str, ImportedSession]
) -> None:
    """Raise DataError if the disk cannot take what is to be copied."""
    held = {(name, one.source(key)) for name, one in sessions.items() for key in one.held}
    new = [e for e in scanned.files if (e.session, e.path.as_posix()) not in held]
    needed = sum(
        _size(folder / e.path)
        for e in new
        if _size(folder / e.path) != _size(sessions[e.session].folder / AUDIO_FOLDER / e.path)
    )  # an import that was killed left files without rows
    free = shutil.disk_usage(paths.data if paths.data.is_dir() else paths.root).free
    if needed > free:
        problem = f"{needed / 1e6:.1f} MB are to be copied, {free / 1e6:.1f} MB are free"
        raise DataError(paths.data, problem, "make room, or import with --reference")


def _size(path: Path) -> int:
    return path.stat().st_size if path.is_file() else 0


def ids_of(members: Sequence[ScannedFile], session: ImportedSession) -> list[str]:
    """Return the id that a file has, or that its row gives, else its path inside the folder without
    suffix (with suffix, if two files would share an id). An id that is too long ends in a digest of
    itself. Raises DataError if two files get one id, or if an id is not a plain name."""
    known = {session.source(name): name for name in session.held}
    stems = [entry.path.with_suffix("").as_posix() for entry in members]
    counts = Counter(stems)
    ids: list[str] = []
    for entry, stem in zip(members, stems, strict=True):
        new = stem if counts[stem] == 1 and stem not in session.held else entry.path.as_posix()
        new = entry.recording_id or new
        ids.append(known.get(entry.path.as_posix(), _short(new)))
    places = dict(zip(ids, members, strict=True))
    if doubled := [name for name, count in Counter(ids).items() if count > 1]:
        files = [e.path.as_posix() for e, name in zip(members, ids, strict=True) if name in doubled]
        problem = f"{', '.join(files[:4])} have one recording_id, {doubled[0]!r}"
        raise DataError("recording_id", problem, "give each file its own")
    for name in ids:
        if wrong := bad_name(name):
            fix = "use letters, digits, '_', '-' and '/'"
            raise DataError(places[name].path, f"recording_id {name!r} {wrong}", fix)
    return ids


def _short(name: str) -> str:
    if len(name) <= LONGEST_ID:
        return name
    return f"{name[: LONGEST_ID - 13]}~{sha256_of(name.encode())[:12]}"


def recording_of(folder: Path, entry: ScannedFile, recording_id: str, *, copy: bool) -> Recording:
    """Return the recording of a file, without its hash; `quality` is "" where nothing tells it."""
    name = entry.path.as_posix() + (".wav" if entry.decode else "")
    try:
        return Recording(
            recording_id=recording_id,
            file=f"{AUDIO_FOLDER}/{name}" if copy else name,
            grasp_id=entry.grasp,
            sample=entry.sample,
            object=entry.object,
            quality=entry.quality,
            labels=dict(entry.labels),
        )
    except ValidationError as error:
        raise describe(error, folder / entry.path) from None
