"""HDF5 files in which no bit changes unnoticed by those who call `check_texts` before they read.

HDF5 has checksums for arrays and for what describes them, but none for its heaps, in which the
texts of attributes lie: a changed bit there would be read as another text, or for ever. Hence a
hash of them, kept in the file. Other readers (xarray, ncdump) do not look at it.
"""

from __future__ import annotations

import hashlib
import io
import mmap
import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import h5netcdf
import h5py
import numpy as np

from ajgdata.store.files import raising_ignored, replacing
from ajgdata.types import DataError

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer as Buffer

#: HDF5 1.10 (2016) and later: its headers and indices carry checksums.
FORMAT = ("v110", "v110")
#: Attributes of a file: where its heaps are (offset and length of each, bytes), and their hash.
#: Both are numbers, which lie in a header with a checksum.
HEAPS, SEAL = "_heaps", "_heaps_sha256"
#: How a heap begins: its signature, version 1, three bytes of nothing, its length.
_BEGINNING = re.compile(rb"GCOL\x01\0\0\0(.{8})", re.DOTALL)
#: Bytes that are read at once.
_PIECE = 2**20


class _Patient(io.FileIO):
    """A file that keeps to itself what the system refuses, in `refused`: HDF5 crashes where it is
    told of a full disk while it closes a file."""

    refused: OSError | None = None

    def write(self, content: Buffer) -> int:
        """Write all of it, if there is room."""
        left = memoryview(content).cast("B")
        length = len(left)
        try:
            while left:
                left = left[super().write(left) :]
        except OSError as error:
            self.refused = self.refused or error
        return length

    def truncate(self, size: int | None = None) -> int:
        """Set the length, if the system lets it."""
        try:
            return super().truncate(size)
        except OSError as error:
            self.refused = self.refused or error
            return size or 0


@contextmanager
def writing(path: Path) -> Iterator[h5netcdf.File]:
    """Yield an empty netCDF-4 file, which takes the place of `path` on success, with a hash of its
    texts. Raises OSError at the end for what could not be written."""
    with replacing(path) as temporary, raising_ignored(), _Patient(temporary, "x+") as file:
        with h5netcdf.File(file, "w", libver=FORMAT) as store:
            yield store
        if not file.refused:
            _seal_texts(file)
        if file.refused:
            raise OSError(file.refused.errno, file.refused.strerror, str(path))


def _seal_texts(file: _Patient) -> None:
    heaps = _heaps(file)
    digest = _digest(file.fileno(), heaps)
    with h5py.File(file, "r+", libver=FORMAT) as store:
        store.attrs[HEAPS] = np.array(heaps, np.int64)
        store.attrs[SEAL] = np.frombuffer(digest, np.uint8)


def check_texts(store: h5py.File) -> None:
    """Raise DataError unless the texts of a file are those that were written, before any is read.
    What has no hash, as older files and those of others, is read as it is. `store` is one that
    HDF5 reads by itself, not through a Python file."""
    if HEAPS not in store.attrs:
        return
    # the very file that is open: another may have taken its name since
    descriptor = store.id.get_vfd_handle()
    try:
        as_written = _digest(descriptor, store.attrs[HEAPS].tolist()) == store.attrs[SEAL].tobytes()
    except ValueError:
        as_written = False
    if not as_written:
        problem = "its texts are not those that were written, or another program wrote it anew"
        fix = f"move it away and run again; of a copy you saved anew, drop {HEAPS} and {SEAL}"
        raise DataError(store.filename, problem, fix)


def _heaps(file: io.FileIO) -> list[int]:
    """Return offset and length of each heap in turn; what merely looks like one does no harm: what
    overlaps counts as one."""
    heaps: list[int] = []
    with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        for found in _BEGINNING.finditer(content):
            start, length = found.start(), int.from_bytes(found[1], "little")
            if not length or start + length > len(content):
                continue
            if heaps and start < sum(heaps[-2:]):
                heaps[-1] = max(heaps[-1], start + length - heaps[-2])
            else:
                heaps += start, length
    return heaps


def _digest(descriptor: int, heaps: Sequence[int]) -> bytes:
    """Return the hash of these parts of an open file, given as offset and length in turn. Raises
    ValueError unless they rise, one after another, and lie in it: nothing is read twice."""
    digest, end, size = hashlib.sha256(), 0, os.fstat(descriptor).st_size
    for start, length in zip(heaps[::2], heaps[1::2], strict=True):
        if start < end or length <= 0 or start + length > size:
            raise ValueError(f"no part of a file: {length} bytes at {start}")
        end = start + length
        for at in range(start, end, _PIECE):
            digest.update(os.pread(descriptor, min(_PIECE, end - at), at))
    return digest.digest()
