"""What one process alone may do: locks that the system frees when their process ends, however.

Who holds a lock is written into its file. Process numbers are told to people and decide nothing:
they are used again, and mean nothing on another machine.
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
#: A temporary folder without a change for so long (s) belongs to a process that was killed.
STALE_S = 3600.0
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
    """Yield an empty temporary folder next to `path` for this process alone; it is removed at the
    end."""
    # Short enough for the file system however long the name is.
    folder = path.with_name(f".{path.name[:40]}{TEMPORARY}")
    _remove_if_stale(folder)
    try:
        folder.mkdir()
    except FileExistsError:  # of another writer
        prefix = f".{path.name[:40]}."
        folder = Path(tempfile.mkdtemp(prefix=prefix, suffix=TEMPORARY, dir=path.parent))
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def remove_stale(folder: Path) -> None:
    """Remove the temporary folders below `folder` that killed processes left, after STALE_S."""
    for path in sorted(folder.rglob(f".*{TEMPORARY}")):
        _remove_if_stale(path)


def _remove_if_stale(folder: Path) -> None:
    with contextlib.suppress(OSError):  # it does not exist, or belongs to another user
        if time.time() - folder.stat().st_mtime > STALE_S:
            shutil.rmtree(folder, ignore_errors=True)
