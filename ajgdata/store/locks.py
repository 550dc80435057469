"""Locks that exclude other processes, and temporary folders.

The system frees a lock when its process ends. The file of a lock names its holder for people;
process numbers decide nothing, because they are used again and mean nothing on another machine.
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
#: Errors of file systems without locks.
_NO_LOCKS = {errno.ENOSYS, errno.ENOLCK, errno.ENOTSUP, errno.EOPNOTSUPP}


@contextmanager
def alone(path: Path, doing: str, fix: str = "wait for that one, or stop it") -> Iterator[None]:
    """Hold the lock of `path`, a file or folder that need not exist, during the work `doing`.

    Raises DataError with holder and start time if another process holds it. On a file system
    without locks, other processes are not noticed.
    """
    from filelock import FileLock, Timeout  # most importers of this module never lock

    path.parent.mkdir(parents=True, exist_ok=True)
    file = path.with_name(f".{path.name}{LOCK}")
    lock = FileLock(file, timeout=0, fallback_to_soft=False)
    try:
        lock.acquire()
    except Timeout:
        raise DataError(path, f"another process is {_holder(file)}", fix) from None
    except OSError as error:
        if error.errno not in _NO_LOCKS:
            raise
    now = datetime.now().astimezone().isoformat(" ", "seconds")
    process = f"pid {os.getpid()} on {platform.node() or 'this machine'} since {now}"
    try:
        file.write_text(f"{doing} ({process})", encoding="utf-8")
        yield
    finally:
        file.write_text("")  # published folders contain no time
        lock.release()


def _holder(file: Path) -> str:
    """Return the work and the process that are written in the file of a lock."""
    with contextlib.suppress(OSError, UnicodeDecodeError):
        if text := " ".join(file.read_text(encoding="utf-8").split()):
            return text
    return "at it since a moment ago"


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
