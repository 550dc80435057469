"""HDF5 files in which no bit changes unnoticed.

HDF5 has checksums for arrays and for what describes them, but none for its heaps, in which the
texts of attributes lie: a changed bit there would be read as another text, or for ever. Hence a
hash of them, kept in the file.
"""

from __future__ import annotations

import hashlib
import mmap
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import h5netcdf
import h5py
import numpy as np

from ajgdata.store.files import raising_ignored, replacing

#: HDF5 1.10 (2016) and later: its headers and indices carry checksums.
FORMAT = ("v110", "v110")
#: Attributes of a file: where its heaps are (offset and length of each, bytes), and their hash.
#: Both are numbers, which lie in a header with a checksum.
HEAPS, SEAL = "_heaps", "_heaps_sha256"
#: How a heap begins: its signature, version 1, three bytes of nothing, its length.
_BEGINNING = re.compile(rb"GCOL\x01\0\0\0(.{8})", re.DOTALL)


@contextmanager
def writing(path: Path) -> Iterator[h5netcdf.File]:
    """Yield an empty netCDF-4 file, which takes the place of `path` on success, with a hash of its
    texts."""
    with replacing(path) as temporary, raising_ignored():
        with h5netcdf.File(temporary, "w", libver=FORMAT) as store:
            yield store
        _seal_texts(temporary)


def _seal_texts(path: Path) -> None:
    with path.open("rb") as stream:
        heaps = list(_heaps(stream))
        digest = _digest(stream, heaps)
    with h5py.File(path, "r+", libver=FORMAT) as store:
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


def _heaps(stream: BinaryIO) -> Iterator[int]:
    """Yield offset and length of each heap in turn; what merely looks like one does no harm."""
    with mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as content:
        for found in _BEGINNING.finditer(content):
            length = int.from_bytes(found[1], "little")
            if found.start() + length <= len(content):
                yield from (found.start(), length)


def _digest(stream: BinaryIO, heaps: Sequence[int]) -> bytes:
    digest = hashlib.sha256()
    for offset, length in zip(heaps[::2], heaps[1::2], strict=True):
        stream.seek(offset)
        digest.update(stream.read(length))
    return digest.digest()
