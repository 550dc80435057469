"""What a machine lacks, in one line: room, permission, open files, memory."""

from __future__ import annotations

import errno
import os
import re

from ajgdata.types import DataError

AGAIN = "run it again: what is complete is kept"
#: Numbers of errors that are no bugs.
_KNOWN = {
    *(errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EPERM),
    *(errno.EMFILE, errno.ENFILE, errno.EIO),
}
#: How libraries report a lack of memory without a number (torch, threads, the loader of libraries).
_NO_MEMORY = re.compile(
    r"can't allocate memory|not enough memory|start new thread|alloc.* failed|failed to map segment"
)


def machine_trouble(error: BaseException) -> DataError | None:
    """Return what `error`, or an error that caused it, says of the machine; None for a bug."""
    seen: BaseException | None = error
    while seen is not None:
        if (found := _trouble(seen)) is not None:
            return found
        seen = seen.__cause__ or (None if seen.__suppress_context__ else seen.__context__)
    return None


def _trouble(error: BaseException) -> DataError | None:
    number, text = getattr(error, "errno", None), str(error)
    is_wrapped = isinstance(error, (RuntimeError, ImportError)) and _NO_MEMORY.search(text)
    if isinstance(error, MemoryError) or number == errno.ENOMEM or is_wrapped:
        fix = f"close other programs, or use fewer processes (`--cores 1`), then {AGAIN}"
        return DataError("memory", "there is not enough", fix)
    if not isinstance(error, (OSError, RuntimeError)):
        return None
    if number not in _KNOWN:  # HDF5 only prints it
        match = re.search(r"errno = (\d+)", text)
        number = int(match[1]) if match else None
    if number not in _KNOWN:
        return None
    name = getattr(error, "filename", None)
    where = os.fsdecode(name) if isinstance(name, (str, bytes)) else "this machine"
    fix = f"check free space, permissions and limits, then {AGAIN}"
    return DataError(where, os.strerror(number).lower(), fix)
