"""Hashes of files that are known already: what has not changed since is not read again."""

from __future__ import annotations

import hashlib
import json
import os
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from ajgdata.store.files import read_json, sha256_of, write_bytes
from ajgdata.types import DataError

#: A file that changed less than this before it was hashed is hashed again next time: its clock may
#: be too coarse (2 s on FAT) to tell a second change.
COARSEST_CLOCK_NS = 2_000_000_000
#: Hashes in a folder that is not there are kept for so long after they were written: it may be on
#: a disk that is away.
AWAY_NS = 30 * 86_400 * 10**9
#: Size, time of change of content and of the inode (ns), and inode.
Mark = list[int]


def absolute(file: str | Path) -> str:
    """Return the absolute path, `..` taken out: what marks are kept by. A `Path` takes ten times
    as long, of each of many files."""
    return os.path.abspath(file)  # noqa: PTH100


def mark_of(file: str) -> Mark:
    """Return what changes when a file does. Raises OSError where there is none."""
    stat = os.stat(file)  # noqa: PTH116
    return [stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns, stat.st_ino]


def is_settled(mark: Mark, now_ns: int) -> bool:
    """Return True if a file was left alone for so long that its next change will show."""
    return now_ns - max(mark[1], mark[2]) > COARSEST_CLOCK_NS


class HashCache:
    """SHA-256 of files, recomputed only when size, times or inode changed.

    One file below `folder` for each folder that holds such files, read when it is asked for, so
    that a change in one of them costs no more where there are many. With `forget` nothing that was
    known before is believed. `seen` has the mark of each file that was asked for, taken before it
    was read.
    """

    def __init__(self, folder: Path, *, forget: bool = False) -> None:
        self.folder, self.forget = folder, forget
        self.seen: dict[str, Mark] = {}
        self._known: dict[str, dict[str, list[Any]]] = {}
        self._changed: set[str] = set()

    def sha256(self, file: Path) -> str:
        """Return the hash of `file`; raises OSError when it cannot be read."""
        path = absolute(file)
        folder, name = os.path.split(path)
        mark = mark_of(path)
        self.seen[path] = mark
        known = self._known_in(folder)
        entry = known.get(name)
        if entry is not None and entry[:4] == mark:
            return str(entry[4])
        now = time.time_ns()
        with file.open("rb") as stream:
            digest = hashlib.file_digest(stream, "sha256").hexdigest()
        if is_settled(mark, now):
            known[name] = [*mark, digest]
            self._changed.add(folder)
        return digest

    def save(self) -> None:
        """Write what the cache learnt, if anything, and forget what is gone."""
        for folder in sorted(self._changed):
            there = _names_in(folder)
            files = {name: one for name, one in self._known[folder].items() if name in there}
            content = {"folder": folder, "files": files}
            write_bytes(self._file(folder), json.dumps(content).encode())
        if self._changed:
            self._forget_the_gone()
        self._changed.clear()

    def _forget_the_gone(self) -> None:
        now = time.time_ns()
        for file in self.folder.glob("*.json"):
            with suppress(FileNotFoundError):  # another process tidies, too
                if now - file.stat().st_mtime_ns > AWAY_NS and not _folder_of(file).is_dir():
                    file.unlink()

    def _file(self, folder: str) -> Path:
        return self.folder / f"{sha256_of(os.fsencode(folder))[:24]}.json"

    def _known_in(self, folder: str) -> dict[str, list[Any]]:
        if folder not in self._known:
            self._known[folder] = {} if self.forget else _read(self._file(folder))
        return self._known[folder]


def _names_in(folder: str) -> set[str]:
    try:
        return set(os.listdir(folder))  # noqa: PTH208 - of thousands of files only the names
    except OSError:  # it went meanwhile
        return set()


def _folder_of(file: Path) -> Path:
    """Return the folder whose hashes a file of the cache holds."""
    try:
        return Path(read_json(file)["folder"])
    except (DataError, LookupError, TypeError):  # damaged, and of no use
        return file


def _read(path: Path) -> dict[str, list[Any]]:
    """Return the hashes in a file of the cache; none if it cannot be read, since they can be made
    again."""
    try:
        files = read_json(path)["files"].items()
    except (DataError, LookupError, TypeError, AttributeError):
        return {}
    return {name: entry for name, entry in files if isinstance(entry, list) and len(entry) == 5}
