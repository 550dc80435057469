"""Download files over HTTP into a cache folder; a file is stored only if its hash is right.

pooch stores complete files by their hash and downloads missing or damaged files again. This module
adds limits on the number and the size of the files.
"""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote, urlsplit

from ajgdata.paths import Tree
from ajgdata.store.publishing.archive import DISTRUST, MAX_BYTES, MAX_TEXT_BYTES
from ajgdata.store.publishing.checksums import is_web_page
from ajgdata.types import DataError

if TYPE_CHECKING:
    from requests import Response, Session

AGAIN = "run it again: complete files are kept"
MAX_FILES = 5_000
#: A server that sends nothing for this long has stopped.
TIMEOUT_S = 30.0
CHUNK_BYTES = 2**14
#: Files of a published data set that are text.
_TEXT_SUFFIXES = ("", ".yaml", ".csv", ".md", ".cff")


def is_web(source: str) -> bool:
    """Return True for a web address. Raises DataError for an address of another kind."""
    scheme, separator, _ = source.partition("://")
    if not separator:
        return False
    if scheme.lower() in ("http", "https"):
        return True
    problem = f"addresses that begin with {scheme}:// are not supported"
    raise DataError(source, problem, "use https, or the name of a folder")


def cache_of(folder: Path, address: str) -> Path:
    """Return the folder below `folder` that stores the files of an address."""
    return folder / hashlib.sha256(address.encode()).hexdigest()[:16]


class Download:
    """Files below a web address, stored in the folder `cache`; `retries` after a failure.

    The limits hold for all files of one instance together.
    """

    def __init__(self, address: str, cache: Path, retries: int = 2) -> None:
        self.address = address.removesuffix(Tree.SUMS).rstrip("/")
        self.cache, self.retries = cache, retries
        self._bytes_left = MAX_BYTES

    def sums(self, sha256: str = "") -> Path:
        """Download SHA256SUMS again and return its path; `sha256` is its own hash, if known."""
        (self.cache / Tree.SUMS).unlink(missing_ok=True)
        known = f"sha256:{sha256}" if sha256 else None
        self._fetch({Tree.SUMS: known}, iter)
        return self.cache / Tree.SUMS

    def files(
        self,
        hashes: Mapping[str, str],
        names: list[str],
        each: Callable[[list[str]], Iterable[str]],
    ) -> None:
        """Download `names` into the cache; `hashes` are those of SHA256SUMS."""
        if len(names) > MAX_FILES:
            problem = f"lists {len(names)} files to download; the limit is {MAX_FILES}"
            fix = "copy the folder by other means, then fetch the folder"
            raise DataError(self.address, problem, fix)
        self._fetch({name: f"sha256:{hashes[name]}" for name in names}, each)

    def _fetch(
        self,
        registry: Mapping[str, str | None],
        each: Callable[[list[str]], Iterable[str]],
    ) -> None:
        import pooch
        import requests

        pooch.get_logger().setLevel(logging.ERROR)
        self.cache.mkdir(parents=True, exist_ok=True)
        urls = {name: f"{self.address}/{quote(name)}" for name in registry}
        fetcher = pooch.create(
            self.cache, f"{self.address}/", registry=dict(registry), urls=urls,
            retry_if_failed=self.retries,
        )  # fmt: skip
        with requests.Session() as session:

            def downloader(url: str, output: Any, *_: object) -> None:
                self._store(session, url, Path(output))

            for name in each(list(registry)):
                try:
                    fetcher.fetch(name, downloader=downloader)
                except (ValueError, requests.RequestException) as error:
                    problem = f"cannot be fetched ({' '.join(str(error).split())[:200]})"
                    raise DataError(urls[name], problem, AGAIN) from None

    def _store(self, session: Session, url: str, output: Path) -> None:
        """Download `url` to `output`. Raises DataError for an answer that may not be stored."""
        limit = MAX_BYTES
        if Path(urlsplit(url).path).suffix in _TEXT_SUFFIXES:
            limit = MAX_TEXT_BYTES
        with session.get(url, stream=True, timeout=TIMEOUT_S) as answer, output.open("wb") as file:
            _check_answer(url, answer)
            for block in answer.iter_content(CHUNK_BYTES):
                if not file.tell() and is_web_page(block):
                    problem = "the server sent a web page (HTML), perhaps a login page"
                    fix = "open the address in a browser, and use one that needs no login"
                    raise DataError(url, problem, fix)
                self._bytes_left -= len(block)
                if self._bytes_left < 0 or file.tell() + len(block) > limit:
                    raise DataError(url, "is too large", DISTRUST)
                file.write(block)


def _check_answer(url: str, answer: Response) -> None:
    """Raise DataError for a redirect from https to http: someone on the way could replace the
    file; and requests.HTTPError for an error of the server."""
    answer.raise_for_status()
    if url.startswith("https:") and not answer.url.startswith("https:"):
        problem = f"leads to {answer.url[:200]}, which is not https"
        raise DataError(url, problem, "do not use it, or ask its owner for another address")
