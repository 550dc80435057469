"""SHA256SUMS, audio.zip and the download of a published data set, which is untrusted input."""

from __future__ import annotations

import hashlib
import logging
import re
import stat
import zipfile
import zlib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any
from urllib.parse import quote, urlsplit
from zipfile import ZipFile

from ajgdata.paths import Tree
from ajgdata.store.audio import file_sha256
from ajgdata.store.files import read_text
from ajgdata.types import DataError

if TYPE_CHECKING:
    import requests

_LINE = re.compile(r"([0-9a-f]{64})  (.+)")
#: The first day that a ZIP file can hold.
_NO_TIME = (1980, 1, 1, 0, 0, 0)
#: What zipfile raises for damaged, encrypted or unknown archives.
_DAMAGE = (zipfile.BadZipFile, zlib.error, OSError, EOFError, ValueError, RuntimeError, LookupError)
#: Largest sum of files that is unpacked or fetched without being asked for.
MAX_BYTES = 50 * 2**30
#: What is read as YAML, CSV or a list of hashes is not larger than this.
MAX_TEXT_BYTES = 2**28
MAX_YAML_BYTES = 2**22
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
    """Yield an archive. Raises DataError when it is none."""
    try:
        archive = ZipFile(path)
    except _DAMAGE as error:
        raise _damaged(path, error) from None
    with archive:
        yield archive


def content_of(archive: ZipFile, name: str) -> bytes:
    """Return one file of an archive. Raises DataError when it is missing or damaged."""
    try:
        return archive.read(name)
    except KeyError:
        raise DataError(archive.filename, f"lacks {name}", "publish the data set again") from None
    except _DAMAGE as error:
        raise _damaged(archive.filename, error) from None


def _damaged(where: object, error: Exception) -> DataError:
    return DataError(where, f"not a readable archive ({error})", "fetch it again")


def problems(archive: ZipFile, folder: str) -> Iterator[tuple[str, str]]:
    """Yield the name and problem of every entry that may not be unpacked: names outside `folder`,
    links, names that occur twice (ignoring case), and archives above MAX_BYTES."""
    entries = archive.infolist()
    counts = Counter(entry.filename.lower() for entry in entries)
    for entry in entries:
        name = entry.filename
        kind = stat.S_IFMT(entry.external_attr >> 16)
        if problem := bad_name(name):
            yield name, problem
        elif not name.startswith(f"{folder}/") or entry.is_dir():
            yield name, f"is no file in {folder}/"
        elif kind not in (0, stat.S_IFREG):
            yield name, "is a link or device, not a file"
        elif counts[name.lower()] > 1:
            yield name, "stands in the archive twice"
    if (total := sum(entry.file_size for entry in entries)) > MAX_BYTES:
        yield "*", f"would be {total / 2**30:.0f} GiB"


def is_web(source: str) -> bool:
    """Return True for a web address. Raises DataError for an address of another kind."""
    scheme, separator, _ = source.partition("://")
    if separator and scheme.lower() not in ("http", "https"):
        problem = f"addresses that begin with {scheme}:// are not supported"
        raise DataError(source, problem, "use https, or name a folder")
    return bool(separator)


def cache_of(folder: Path, address: str) -> Path:
    """Return the folder below `folder` that stores the files of an address."""
    return folder / hashlib.sha256(address.encode()).hexdigest()[:16]


def download(
    address: str,
    cache: Path,
    hashes: Mapping[str, str],
    *,
    each: Callable[[list[str]], Iterable[str]] = iter,
    retries: int = 2,
) -> None:
    """Download files below `address` into `cache`; `hashes` has their sha256 ("": unknown) by name.

    pooch keeps complete files and downloads missing or damaged files again. `each` iterates over
    the names. Raises DataError for what cannot be downloaded, and for a redirect from https to
    http, because someone on the way could then replace the file.
    """
    import pooch
    import requests

    pooch.get_logger().setLevel(logging.ERROR)
    cache.mkdir(parents=True, exist_ok=True)
    for name in (name for name, digest in hashes.items() if not digest):
        (cache / name).unlink(missing_ok=True)
    registry = {name: f"sha256:{digest}" if digest else None for name, digest in hashes.items()}
    urls = {name: f"{address.rstrip('/')}/{quote(name)}" for name in hashes}
    fetcher = pooch.create(
        cache, f"{address}/", registry=registry, urls=urls, retry_if_failed=retries
    )
    with requests.Session() as session:
        for name in each(list(hashes)):
            try:
                fetcher.fetch(name, downloader=partial(_store, session))
            except (ValueError, requests.RequestException) as error:
                problem = f"cannot be fetched ({' '.join(str(error).split())[:200]})"
                raise DataError(urls[name], problem, AGAIN) from None


def _store(session: requests.Session, url: str, output: Any, *_: object) -> None:
    """Write the answer to `url` to the file `output`."""
    with session.get(url, stream=True, timeout=TIMEOUT_S) as answer:
        answer.raise_for_status()
        if urlsplit(url).scheme == "https" != urlsplit(answer.url).scheme:
            raise DataError(url, f"leads to {answer.url[:200]}, which is not https", DISTRUST)
        with Path(output).open("wb") as stream:
            for block in answer.iter_content(2**16):
                stream.write(block)
                if stream.tell() > MAX_BYTES:
                    raise DataError(url, "is too large", DISTRUST)
