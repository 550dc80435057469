"""Locks of files and folders: only one process at a time does a work."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from ajgdata.types import DataError

#: Work of imports and fetches, which exclude each other.
ADDING_RECORDINGS = "bringing recordings into this data set"


@contextmanager
def locked(path: Path, work: str, fix: str = "wait for that one, or stop it") -> Iterator[None]:
    """Hold the lock of `path`, a file or folder that need not exist, during `work`.

    The file of the lock states the work and the process. The system frees the lock when the process
    ends. Raises DataError with this text if another process holds the lock.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    file = path.with_name(f".{path.name}.lock")
    lock = FileLock(file, timeout=0)
    try:
        lock.acquire()
    except Timeout:
        holder = " ".join(file.read_text(encoding="utf-8").split()) or "at it"
        raise DataError(path, f"another process is {holder}", fix) from None
    try:
        file.write_text(f"{work} (pid {os.getpid()} on {platform.node()})", encoding="utf-8")
        yield
    finally:
        file.write_text("", encoding="utf-8")
        lock.release()
