"""Download files over HTTP into a cache folder; a file is stored only if its hash is right."""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote, urlsplit

from ajgdata.store.publishing.archive import DISTRUST, MAX_BYTES
from ajgdata.types import DataError

if TYPE_CHECKING:
    import requests

AGAIN = "run it again: complete files are kept"
#: A server that sends nothing for so long has failed.
TIMEOUT_S = 30.0


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
