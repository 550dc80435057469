"""HDF5 files in which no bit changes unnoticed.

HDF5 has checksums for arrays and for what describes them, but none for its heaps, in which the
texts of attributes lie: a changed bit there would be read as another text, or for ever. Hence a
hash of them, kept in the file.
"""

from __future__ import annotations

import hashlib
import io
import mmap
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import h5netcdf
import h5py
import numpy as np

from ajgdata.store.files import raising_ignored, replacing

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer as Buffer

#: HDF5 1.10 (2016) and later: its headers and indices carry checksums.
FORMAT = ("v110", "v110")
#: Attributes of a file: where its heaps are (offset and length of each, bytes), and their hash.
#: Both are numbers, which lie in a header with a checksum.
HEAPS, SEAL = "_heaps", "_heaps_sha256"
#: How a heap begins: its signature, version 1, three bytes of nothing, its length.
_BEGINNING = re.compile(rb"GCOL\x01\0\0\0(.{8})", re.DOTALL)


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
    heaps = list(_heaps(file))
    digest = _digest(file, heaps)
    with h5py.File(file, "r+", libver=FORMAT) as store:
        store.attrs[HEAPS] = np.array(heaps, np.int64)
        store.attrs[SEAL] = np.frombuffer(digest, np.uint8)


def check_texts(store: h5py.File) -> None:
    """Raise ValueError unless the texts of a file are those that were written, before any is read.
    What has no hash, as older files and those of others, is read as it is."""
    if HEAPS not in store.attrs:
        return
    with Path(store.filename).open("rb") as stream:
        digest = _digest(stream, store.attrs[HEAPS].tolist())
    if digest != store.attrs[SEAL].tobytes():
        raise ValueError("its texts are not those that were written")


def _heaps(stream: BinaryIO | io.FileIO) -> Iterator[int]:
    """Yield offset and length of each heap in turn; what merely looks like one does no harm."""
    with mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as content:
        for found in _BEGINNING.finditer(content):
            length = int.from_bytes(found[1], "little")
            if found.start() + length <= len(content):
                yield from (found.start(), length)


def _digest(stream: BinaryIO | io.FileIO, heaps: Sequence[int]) -> bytes:
    digest = hashlib.sha256()
    for offset, length in zip(heaps[::2], heaps[1::2], strict=True):
        stream.seek(offset)
        digest.update(stream.read(length))
    return digest.digest()
