"""What one process alone may do: locks that the system frees when their process ends, however.

Who holds a lock is written into its file. Process numbers are told to people and decide nothing:
they are used again, and mean nothing on another machine.
"""

from __future__ import annotations

import contextlib
import errno
import itertools
import os
import platform
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from datetime import datetime
from pathlib import Path

from ajgdata.types import DataError

#: Temporary folders end with it, and their lock has this name.
TEMPORARY, LOCK = ".tmp", ".lock"
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
    """Yield a temporary folder beside `path` that is this process's alone and empty but for its
    lock; it is removed at the end. What a killed process left in it is removed at the start; not so
    where the file system has no locks, as nobody knows there whether it was killed."""
    with ExitStack() as stack:
        for number in itertools.count():
            # Short enough for the file system however long the name is.
            name = f".{path.name[:40]}{f'.{number}' if number else ''}{TEMPORARY}"
            is_ours = stack.enter_context(_owned(path.with_name(name)))
            if is_ours is None:
                own = tempfile.TemporaryDirectory(
                    prefix=f".{path.name[:40]}.", suffix=TEMPORARY, dir=path.parent
                )
                yield Path(stack.enter_context(own))
                return
            if is_ours:
                yield path.with_name(name)
                return


@contextmanager
def _owned(folder: Path) -> Iterator[bool | None]:
    """Yield whether `folder` is this process's now, None if the file system has no locks; if it is,
    it is emptied, and removed at the end."""
    is_new = not folder.exists()
    folder.mkdir(exist_ok=True)
    is_ours: bool | None = False
    try:
        with ExitStack() as stack:
            try:
                is_ours = stack.enter_context(_lock(folder / LOCK))
            except FileNotFoundError:  # another process has just removed it
                is_ours = False
            except PermissionError:
                if is_new:  # not another user's: nobody may write here
                    raise
            if is_ours:
                _empty(folder)
            try:
                yield is_ours
            finally:
                if is_ours:
                    _empty(folder)
                if is_ours or (is_ours is None and is_new):
                    (folder / LOCK).unlink(missing_ok=True)
    finally:
        if is_ours or is_new:
            with contextlib.suppress(OSError):  # another process has just taken it
                folder.rmdir()


def _empty(folder: Path) -> None:
    for left in folder.iterdir():
        if left.name != LOCK:
            shutil.rmtree(left) if left.is_dir() else left.unlink(missing_ok=True)


def remove_abandoned(folder: Path) -> None:
    """Remove the temporary folders below `folder` whose process is gone; living ones still
    write."""
    for path in sorted(folder.rglob(f".*{TEMPORARY}")):
        remove_if_abandoned(path)


def remove_if_abandoned(path: Path) -> None:
    """Remove a temporary folder unless a process writes into it."""
    if path.is_dir():
        with _owned(path):
            pass
