"""SHA256SUMS, audio.zip and the download of a published data set, which is untrusted input."""

from __future__ import annotations

import logging
import re
import stat
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
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
#: What zipfile raises for damaged, encrypted or unknown archives.
_DAMAGE = (zipfile.BadZipFile, zlib.error, OSError, EOFError, ValueError, RuntimeError, LookupError)
#: Largest unpacked archive and recording, because a small archive can unpack to any size.
MAX_BYTES, MAX_FILE_BYTES = 50 * 2**30, 2**30
AGAIN = "run it again: complete files are kept"
#: A server that sends nothing for so long has failed.
TIMEOUT_S = 30.0
#: What to do about a data set that looks like an attack.
DISTRUST = "do not use this data set"


def bad_name(name: str) -> str:
    """Return why `name` cannot be a file inside a tree; empty if it can."""
    parts = name.split("/")
    if name.startswith("/") or ".." in parts or "\\" in name or ":" in name:
        return "leaves the folder"
    is_plain = PurePosixPath(name).as_posix() == name and name.isprintable()
    return "" if name and is_plain and "." not in parts else "is no plain name of a file"


def checksums_bytes(root: Path) -> bytes:
    """Return SHA256SUMS of the files below `root`, in the format of `sha256sum -c`."""
    files = {path.relative_to(root).as_posix(): path for path in root.rglob("*") if path.is_file()}
    names = sorted(files.keys() - {Tree.SUMS})
    return "".join(f"{file_sha256(files[name])}  {name}\n" for name in names).encode()


def read_checksums(path: Path) -> dict[str, str]:
    """Return hashes by file name.

    Raises DataError for an invalid line, a name that would leave the tree, and a name that is
    listed twice (ignoring case).
    """
    hashes: dict[str, str] = {}
    seen: set[str] = set()
    for number, line in enumerate(read_text(path).splitlines(), 1):
        where, match = f"{path}:{number}", _LINE.fullmatch(line)
        if not match:
            fix = "fetch the file itself (not a page that shows it), or publish again"
            raise DataError(where, "is no `sha256  name`", fix)
        digest, name = match.groups()
        if problem := bad_name(name) or ("stands twice" if name.lower() in seen else ""):
            raise DataError(where, f"{name!r} {problem}", DISTRUST)
        hashes[name] = digest
        seen.add(name.lower())
    return hashes


def add(archive: ZipFile, name: str, content: bytes) -> None:
    """Store a file. Nothing is compressed: WAVs hardly do, and the bytes would depend on zlib."""
    entry = zipfile.ZipInfo(name, _NO_TIME)
    entry.create_system = 3  # Unix, wherever this runs
    entry.external_attr = (stat.S_IFREG | 0o644) << 16
    archive.writestr(entry, content)


@contextmanager
def reading(path: Path) -> Iterator[ZipFile]:
    """Yield an archive. Raises DataError if it is damaged or unpacks to too many bytes."""
    try:
        archive = ZipFile(path)
    except _DAMAGE as error:
        raise _damaged(path, error) from None
    with archive:
        if (size := sum(entry.file_size for entry in archive.infolist())) > MAX_BYTES:
            raise DataError(path, f"unpacks to {size / 1e9:.0f} GB", DISTRUST)
        yield archive


def content_of(archive: ZipFile, name: str) -> bytes:
    """Return one file of an archive. Raises DataError if it is missing, damaged or too large."""
    try:
        if (size := archive.getinfo(name).file_size) > MAX_FILE_BYTES:
            raise DataError(archive.filename, f"{name} unpacks to {size / 1e9:.0f} GB", DISTRUST)
        return archive.read(name)
    except KeyError:
        raise DataError(archive.filename, f"lacks {name}", "publish the data set again") from None
    except _DAMAGE as error:
        raise _damaged(archive.filename, error) from None


def _damaged(where: object, error: Exception) -> DataError:
    return DataError(where, f"not a readable archive ({error})", "fetch it again")


def is_web(source: str) -> bool:
    """Return True for a web address. Raises DataError for an address of another kind."""
    scheme, separator, _ = source.partition("://")
    if separator and scheme.lower() not in ("http", "https"):
        problem = f"addresses that begin with {scheme}:// are not supported"
        raise DataError(source, problem, "use https, or name a folder")
    return bool(separator)


def download(
    address: str,
    folder: Path,
    hashes: Mapping[str, str],
    *,
    each: Callable[[list[str]], Iterable[str]] = iter,
) -> None:
    """Download files below `address` into `folder`; `hashes` has their sha256 ("": unknown) by
    name.

    pooch keeps complete files and downloads missing or damaged files again. `each` iterates over
    the names. Raises DataError for what cannot be downloaded.
    """
    import pooch
    import requests

    pooch.get_logger().setLevel(logging.ERROR)
    for name in each(list(hashes)):
        url, known = f"{address.rstrip('/')}/{quote(name)}", hashes[name]
        target = folder / name
        if not known:
            target.unlink(missing_ok=True)
        try:
            pooch.retrieve(
                url,
                f"sha256:{known}" if known else None,
                fname=target.name,
                path=target.parent,
                downloader=pooch.HTTPDownloader(timeout=TIMEOUT_S),
            )
        except (ValueError, requests.RequestException) as error:
            problem = f"cannot be fetched ({' '.join(str(error).split())[:200]})"
            raise DataError(url, problem, AGAIN) from None
