"""Locks, which the system frees when their process ends, and temporary folders.

The holder of a lock is written into its file, for people only.
"""

from __future__ import annotations

import contextlib
import errno
import os
import platform
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path

from ajgdata.types import DataError

#: Ends of the names of temporary folders and of locks.
TEMPORARY, LOCK = ".tmp", ".lock"
#: Age of a temporary folder that no process uses any more.
ABANDONED_S = 24 * 3600
#: What imports and fetches do; they exclude each other.
BRINGING = "bringing recordings into this data set"
#: What file systems answer that have no locks.
_NO_LOCKS = {errno.ENOSYS, errno.ENOLCK, errno.ENOTSUP, errno.EOPNOTSUPP}


@contextmanager
def alone(path: Path, doing: str, fix: str = "wait for that one, or stop it") -> Iterator[None]:
    """Hold the lock of `path`, a file or folder that need not be there, to do what `doing` says.

    Raises DataError, with who does it now and since when, if another process holds it. Where the
    file system has no locks, others are not noticed.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    file = path.with_name(f".{path.name}{LOCK}")
    with _lock(file) as is_held:
        if is_held is False:
            raise DataError(path, f"another process is {holder(file)}", fix)
        file.write_text(f"{doing} ({described()})", encoding="utf-8")
        try:
            yield
        finally:
            file.write_text("")  # nobody holds it: what stays beside the data has no time in it


def described() -> str:
    """Return who this process is, for `holder`."""
    now = datetime.now().astimezone().isoformat(" ", "seconds")
    return f"pid {os.getpid()} on {platform.node() or 'this machine'} since {now}"


def holder(lock: Path) -> str:
    """Return what whoever holds a lock wrote into its file."""
    with contextlib.suppress(OSError, UnicodeDecodeError):
        if said := " ".join(lock.read_text(encoding="utf-8").split()):
            return said
    return "at it since a moment ago"


@contextmanager
def _lock(file: Path) -> Iterator[bool | None]:
    """Yield whether this process holds the lock in `file`, None if the file system has no locks; it
    is free again at the end."""
    from filelock import FileLock, Timeout  # most of what imports this module never locks

    lock = FileLock(file, timeout=0, fallback_to_soft=False)
    try:
        lock.acquire()
    except Timeout:
        yield False
        return
    except OSError as error:
        if error.errno not in _NO_LOCKS:
            raise
        yield None
        return
    try:
        yield True
    finally:
        lock.release()


@contextmanager
def own_folder(path: Path) -> Iterator[Path]:
    """Yield an empty temporary folder beside `path`; it is removed at the end."""
    prefix = f".{path.name[:40]}."  # short enough for the file system
    with tempfile.TemporaryDirectory(TEMPORARY, prefix, path.parent) as folder:
        yield Path(folder)


def remove_abandoned(folder: Path) -> None:
    """Remove temporary folders below `folder` that were not changed for a day: their process was
    killed."""
    oldest_s = time.time() - ABANDONED_S
    for path in sorted(folder.rglob(f".*{TEMPORARY}")):
        with contextlib.suppress(FileNotFoundError):  # another process has just removed it
            if path.is_dir() and path.stat().st_mtime < oldest_s:
                shutil.rmtree(path, ignore_errors=True)
