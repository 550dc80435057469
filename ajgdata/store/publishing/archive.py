"""SHA256SUMS and audio.zip of a published data set. What a download contains is not trusted."""

from __future__ import annotations

import re
import stat
import zipfile
from pathlib import Path, PurePosixPath
from zipfile import ZipFile

from ajgdata.paths import Tree
from ajgdata.store.audio import file_sha256
from ajgdata.store.files import read_text
from ajgdata.types import DataError

#: Line of SHA256SUMS: hash and name.
_LINE = re.compile(r"([0-9a-f]{64})  (.+)")
#: Time of all files in the archive: the earliest time of a ZIP file.
_NO_TIME = (1980, 1, 1, 0, 0, 0)
#: Largest unpacked archive, because a small archive can unpack to any size.
MAX_BYTES = 50 * 2**30
#: Largest SHA256SUMS that is read: about 600,000 lines.
MAX_SUMS_BYTES = 64 * 2**20
#: Fix for a data set that looks like an attack.
DISTRUST = "do not use this data set"


def is_inside(name: str) -> bool:
    """Return True if `name` is the plain name of a file inside a folder."""
    is_plain = PurePosixPath(name).as_posix() == name and name.isprintable()
    return is_plain and name[:1] not in ("/", ".") and not re.search(r"\.\.|[\\:]", name)


def checksums_bytes(root: Path) -> bytes:
    """Return SHA256SUMS of the files below `root`, in the format of `sha256sum -c`."""
    files = {path.relative_to(root).as_posix(): path for path in root.rglob("*") if path.is_file()}
    names = sorted(files.keys() - {Tree.SUMS})
    return "".join(f"{file_sha256(files[name])}  {name}\n" for name in names).encode()


def read_checksums(path: Path) -> dict[str, str]:
    """Return the hashes of SHA256SUMS by file name.

    Raises DataError for an invalid line, for a name that leads out of the folder, and for a file of
    more than MAX_SUMS_BYTES.
    """
    hashes: dict[str, str] = {}
    for number, line in enumerate(read_text(path, MAX_SUMS_BYTES).splitlines(), 1):
        location = f"{path}:{number}"
        match = _LINE.fullmatch(line)
        if not match:
            fix = "fetch the file itself (not a page that shows it), or publish again"
            raise DataError(location, "is not a line `sha256  name`", fix)
        digest, name = match.groups()
        if not is_inside(name):
            raise DataError(location, f"{name!r} leaves the folder", DISTRUST)
        hashes[name] = digest
    return hashes


def add(archive: ZipFile, name: str, content: bytes) -> None:
    """Store a file without compression.

    Compression hardly reduces the size of WAVs, and its bytes would depend on the version of zlib.
    """
    entry = zipfile.ZipInfo(name, _NO_TIME)
    entry.create_system = 3  # Unix, on every system
    entry.external_attr = (stat.S_IFREG | 0o644) << 16
    archive.writestr(entry, content)


def open_archive(path: Path) -> ZipFile:
    """Return an open archive. Raises DataError if it unpacks to too many bytes."""
    archive = ZipFile(path)
    size = sum(entry.file_size for entry in archive.infolist())
    if size > MAX_BYTES:
        archive.close()
        raise DataError(path, f"unpacks to {size / 1e9:.0f} GB", DISTRUST)
    return archive
