"""Locks of files and folders: only one process at a time does a work."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

from ajgdata.types import DataError

#: Work of imports and fetches, which exclude each other.
ADDING_RECORDINGS = "bringing recordings into this data set"


@contextmanager
def locked(
    path: Path, work: str, fix: str = "wait for that one, or stop it", *, wait_s: float = 0
) -> Iterator[None]:
    """Hold the lock of `path`, a file or folder that need not exist, during `work`.

    A file next to the lock states the work and the process, because Windows does not let anyone
    read or write a locked file. The system frees the lock when the process ends. Raises DataError
    with this text if another process holds the lock for longer than `wait_s`.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    lock = FileLock(path.with_name(f".{path.name}.lock"), timeout=wait_s)
    holder = path.with_name(f".{path.name}.holder")
    try:
        lock.acquire()
    except Timeout:
        raise DataError(path, f"another process is {_text_of(holder)}", fix) from None
    try:
        holder.write_text(f"{work} (pid {os.getpid()} on {platform.node()})", encoding="utf-8")
        yield
    finally:
        with suppress(OSError):  # another process reads it; the next holder replaces the text
            holder.unlink()
        lock.release()


def _text_of(holder: Path) -> str:
    """Return the work and the process of a holder, or "working" before it has written them."""
    try:
        return " ".join(holder.read_text(encoding="utf-8").split()) or "working"
    except OSError:
        return "working"
