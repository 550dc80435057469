"""What a machine lacks, in one line: room, permission, open files, memory."""

from __future__ import annotations

import errno
import os
import re

from ajgdata.types import DataError

AGAIN = "run it again: what is complete is kept"
_FULL = ("the disk is full", f"make room, then {AGAIN}")
_DENIED = ("the system does not permit it", "check who owns it and its permissions")
_FILES = ("too many files are open", f"raise the limit (`ulimit -n 4096`), then {AGAIN}")
#: What is wrong and what to do, by the system's number.
_KNOWN = {
    errno.ENOSPC: _FULL,
    errno.EDQUOT: ("the disk quota is used up", f"make room, then {AGAIN}"),
    errno.EROFS: ("it can only be read, not written", "write elsewhere, or mount it for writing"),
    errno.EACCES: _DENIED,
    errno.EPERM: _DENIED,
    errno.EMFILE: _FILES,
    errno.ENFILE: _FILES,
    errno.EIO: ("the disk reports an error", "look at the disk; copy what can be read"),
}
_MEMORY = f"close other programs, or use fewer processes (`--cores 1`), then {AGAIN}"
#: How libraries say it that keep the number to themselves (HDF5, torch, threads of Python, the
#: loader of libraries).
_NO_MEMORY = re.compile(
    r"can't allocate memory|not enough memory|start new thread|alloc.* failed|failed to map segment"
)


def machine_trouble(error: BaseException) -> DataError | None:
    """Return what `error` says of the machine, as one line; None for anything else.

    Libraries wrap errors: those that `error` came from are asked, too.
    """
    seen: BaseException | None = error
    while seen is not None:
        if (found := _trouble(seen)) is not None:
            return found
        seen = seen.__cause__ or (None if seen.__suppress_context__ else seen.__context__)
    return None


def _trouble(error: BaseException) -> DataError | None:
    if (
        isinstance(error, MemoryError)
        or (isinstance(error, OSError) and error.errno == errno.ENOMEM)
        or (isinstance(error, (RuntimeError, ImportError)) and _NO_MEMORY.search(str(error)))
    ):
        return DataError("memory", "there is not enough", _MEMORY)
    if not isinstance(error, (OSError, RuntimeError)):
        return None
    number = getattr(error, "errno", None)
    if number not in _KNOWN:
        said = re.search(r"errno = (\d+)", str(error))
        number = int(said[1]) if said else None
    if number not in _KNOWN:
        return None
    return DataError(_place(error, number), *_KNOWN[number])


def _place(error: BaseException, number: int) -> object:
    """Return the file that it is about, if the error knows."""
    name = getattr(error, "filename", None)
    return os.fsdecode(name) if isinstance(name, (str, bytes)) else os.strerror(number).lower()
