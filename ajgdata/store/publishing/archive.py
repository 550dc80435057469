"""SHA256SUMS, audio.zip and the download of a published data set, which is untrusted input."""

from __future__ import annotations

import logging
import re
import stat
import zipfile
from pathlib import Path, PurePosixPath
from urllib.parse import quote
from zipfile import ZipFile

from ajgdata.paths import Tree
from ajgdata.store.audio import file_sha256
from ajgdata.store.files import read_text
from ajgdata.types import DataError

_LINE = re.compile(r"([0-9a-f]{64})  (.+)")
#: The first day that a ZIP file can hold.
_NO_TIME = (1980, 1, 1, 0, 0, 0)
#: Largest unpacked archive, because a small archive can unpack to any size.
MAX_BYTES = 50 * 2**30
#: Largest SHA256SUMS that is read: about 600,000 lines.
MAX_SUMS_BYTES = 64 * 2**20
RUN_AGAIN = "run it again: complete files are kept"
#: A server that sends nothing for so long has failed.
REQUEST_TIMEOUT_S = 30.0
#: What to do about a data set that looks like an attack.
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
    """Return hashes by file name. Raises DataError for an invalid line, for a name that would leave
    the folder, and for a file of more than MAX_SUMS_BYTES."""
    hashes: dict[str, str] = {}
    for number, line in enumerate(read_text(path, MAX_SUMS_BYTES).splitlines(), 1):
        location, match = f"{path}:{number}", _LINE.fullmatch(line)
        if not match:
            fix = "fetch the file itself (not a page that shows it), or publish again"
            raise DataError(location, "is not a line `sha256  name`", fix)
        digest, name = match.groups()
        if not is_inside(name):
            raise DataError(location, f"{name!r} leaves the folder", DISTRUST)
        hashes[name] = digest
    return hashes


def add(archive: ZipFile, name: str, content: bytes) -> None:
    """Store a file. Nothing is compressed: WAVs hardly do, and the bytes would depend on zlib."""
    entry = zipfile.ZipInfo(name, _NO_TIME)
    entry.create_system = 3  # Unix, wherever this runs
    entry.external_attr = (stat.S_IFREG | 0o644) << 16
    archive.writestr(entry, content)


def open_archive(path: Path) -> ZipFile:
    """Return an open archive. Raises DataError if it unpacks to too many bytes."""
    archive = ZipFile(path)
    if (size := sum(entry.file_size for entry in archive.infolist())) > MAX_BYTES:
        archive.close()
        raise DataError(path, f"unpacks to {size / 1e9:.0f} GB", DISTRUST)
    return archive


def is_web(source: str) -> bool:
    """Return True for a web address. Raises DataError for an address of another kind."""
    scheme, separator, _ = source.partition("://")
    if separator and scheme.lower() not in ("http", "https"):
        problem = f"addresses that begin with {scheme}:// are not supported"
        raise DataError(source, problem, "use https, or name a folder")
    return bool(separator)


def download(address: str, folder: Path, name: str, sha256: str = "") -> None:
    """Download the file `name` below `address` into `folder`; `sha256` is its hash, if it is known.

    pooch keeps a complete file and downloads a missing or damaged one again. Raises DataError for a
    file that cannot be downloaded.
    """
    import pooch
    import requests

    pooch.get_logger().setLevel(logging.ERROR)
    url, target = f"{address.rstrip('/')}/{quote(name)}", folder / name
    if not sha256:
        target.unlink(missing_ok=True)
    try:
        pooch.retrieve(
            url,
            f"sha256:{sha256}" if sha256 else None,
            fname=target.name,
            path=target.parent,
            downloader=pooch.HTTPDownloader(timeout=REQUEST_TIMEOUT_S),
        )
    except (ValueError, requests.RequestException) as error:
        problem = f"cannot be fetched ({' '.join(str(error).split())[:200]})"
        raise DataError(url, problem, RUN_AGAIN) from None
