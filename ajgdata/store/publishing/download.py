"""Download files over HTTP into a cache folder; a file is stored only if its hash is right.

pooch stores complete files by their hash and downloads missing or damaged files again. This module
adds limits on time, requests and bytes.
"""

from __future__ import annotations

import hashlib
import logging
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote, urljoin, urlsplit

from ajgdata.paths import Tree
from ajgdata.store.publishing.archive import DISTRUST, MAX_BYTES, MAX_TEXT_BYTES
from ajgdata.store.publishing.checksums import is_web_page
from ajgdata.types import DataError

if TYPE_CHECKING:
    from requests import Response, Session

AGAIN = "run it again: complete files are kept"
#: Limits of one download: requests (redirects and retries count), seconds, and bytes per second,
#: the mean of one file after its first START_S seconds.
MAX_REQUESTS = 5_000
MAX_S = 12 * 3600.0
MIN_BYTES_PER_S = 1_000
START_S = 30.0
CHUNK_BYTES = 2**14
#: Schemes that an address may redirect to: never to a less secure one.
_ALLOWED = {"https": ("https",), "http": ("http", "https")}
MAX_REDIRECTS = 10
#: Files of a published data set that are text.
_TEXT_SUFFIXES = ("", ".yaml", ".csv", ".md", ".cff")


def is_web(source: str) -> bool:
    """Return True for a web address. Raises DataError for an address of another kind."""
    scheme, separator, _ = source.partition("://")
    if not separator:
        return False
    if scheme.lower() in _ALLOWED:
        return True
    fix = "Name the folder without 'file://'" if scheme.lower() == "file" else "Use https"
    raise DataError(source, f"addresses that begin with {scheme}:// are not supported", fix)


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
        self._requests_left, self._bytes_left = MAX_REQUESTS, MAX_BYTES
        self._end = time.monotonic() + MAX_S
        self._stopped = threading.Event()

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
        if len(names) > MAX_REQUESTS:
            problem = f"lists {len(names)} files to download; the limit is {MAX_REQUESTS}"
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
                self._supervised(url, lambda: self._stored(session, url, Path(output)))

            for name in each(list(registry)):
                try:
                    fetcher.fetch(name, downloader=downloader)
                except (ValueError, requests.RequestException) as error:
                    problem = f"cannot be fetched ({' '.join(str(error).split())[:200]})"
                    raise DataError(urls[name], problem, AGAIN) from None

    def _supervised(self, url: str, transfer: Callable[[], None]) -> None:
        """Run `transfer` in a thread, so that a slow server cannot block this process.

        Raises DataError when the server is slower than MIN_BYTES_PER_S, and when the whole download
        has taken MAX_S. A thread that still waits for the server then writes nothing more.
        """
        errors: list[BaseException] = []

        def run() -> None:
            try:
                transfer()
            except BaseException as error:  # raised again below, in the main thread
                errors.append(error)

        thread = threading.Thread(target=run, daemon=True)
        begin, bytes_before = time.monotonic(), self._bytes_left
        thread.start()
        while thread.is_alive():
            thread.join(0.1)
            now = time.monotonic()
            received, seconds = bytes_before - self._bytes_left, now - begin
            problem = ""
            if received < (seconds - START_S) * MIN_BYTES_PER_S:
                problem = f"the server sent {received} bytes in {seconds:.0f} s"
            elif now > self._end:
                problem = f"the download took longer than {MAX_S / 3600:g} h"
            if problem and thread.is_alive():
                self._stopped.set()
                raise DataError(url, problem, AGAIN)
        if errors:
            raise errors[0]

    def _stored(self, session: Session, url: str, output: Path) -> None:
        """Download `url` to `output`."""
        with self._answer(session, url) as answer, output.open("wb") as stream:
            answer.raise_for_status()
            for block in answer.iter_content(CHUNK_BYTES):
                if self._stopped.is_set():
                    return
                if problem := self._problem(url, block, stream.tell()):
                    raise problem
                stream.write(block)

    def _problem(self, url: str, block: bytes, offset: int) -> DataError | None:
        """Return why `block`, at `offset` of its file, may not be stored; None if it may."""
        self._bytes_left -= len(block)
        if not offset and is_web_page(block):
            problem = "the server sent a web page (HTML) instead of the file, perhaps a login page"
            fix = "open the address in a browser, and use one that needs no login"
            return DataError(url, problem, fix)
        is_text = Path(urlsplit(url).path).suffix in _TEXT_SUFFIXES
        if self._bytes_left < 0 or (is_text and offset + len(block) > MAX_TEXT_BYTES):
            return DataError(url, "is too large", DISTRUST)
        return None

    def _answer(self, session: Session, url: str) -> Response:
        """Return the answer to `url`, after redirects. Raises DataError for a redirect from https
        to http: someone on the way could then replace the file."""
        location = url
        for _ in range(MAX_REDIRECTS + 1):
            self._requests_left -= 1
            if self._requests_left < 0:
                problem = f"needs more than {MAX_REQUESTS} requests"
                raise DataError(self.address, problem, DISTRUST)
            answer = session.get(location, stream=True, timeout=START_S, allow_redirects=False)
            target = session.get_redirect_target(answer)
            if target is None:
                return answer
            answer.close()
            location = urljoin(answer.url, target)
            if urlsplit(location).scheme not in _ALLOWED[urlsplit(answer.url).scheme]:
                problem = f"leads to {location[:200]}, which is not https"
                raise DataError(url, problem, "do not use it, or ask its owner for another address")
        fix = "use the address to which it leads"
        raise DataError(url, f"leads on more than {MAX_REDIRECTS} times", fix)
