"""Files of a published data set from the web, each kept only if its hash is right.

pooch keeps what is complete by its hash and fetches again what is missing or damaged. It knows no
resuming within a file: that is `_Resuming`, where the server can (HTTP ranges).
"""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote, urljoin, urlsplit

from ajgdata.paths import Tree
from ajgdata.store.publishing.archive import MAX_BYTES, MAX_TEXT_BYTES
from ajgdata.types import DataError

if TYPE_CHECKING:
    from requests import Response

AGAIN = "run it again: what is complete is kept"
_TIMEOUT_S = 30
#: A cut connection loses less than this.
CHUNK_BYTES = 2**14
#: Where an address may lead on to, by its scheme: never to what is less safe.
_ALLOWED = {"https": ("https",), "http": ("http", "https")}
MAX_REDIRECTS = 10


def is_web(source: str) -> bool:
    """Return True for a web address."""
    return urlsplit(source).scheme in ("http", "https")


def cache_of(folder: Path, address: str) -> Path:
    """Return the folder below `folder` in which the files of an address are kept."""
    return folder / hashlib.sha256(address.encode()).hexdigest()[:16]


class Download:
    """Files below a web address, kept in the folder `cache`. `retries` after a failure."""

    def __init__(self, address: str, cache: Path, retries: int = 2) -> None:
        self.address = address.removesuffix(Tree.SUMS).rstrip("/")
        self.cache, self.retries = cache, retries
        self.left = MAX_BYTES

    def sums(self, sha256: str = "") -> Path:
        """Return SHA256SUMS, always anew; `sha256` is its own hash, if it is known."""
        (self.cache / Tree.SUMS).unlink(missing_ok=True)
        known = f"sha256:{sha256}" if sha256 else None
        self.left = MAX_TEXT_BYTES
        self._fetch({Tree.SUMS: known}, [Tree.SUMS], lambda names: names)
        self.left = MAX_BYTES
        return self.cache / Tree.SUMS

    def files(
        self,
        hashes: Mapping[str, str],
        names: list[str],
        each: Callable[[list[str]], Iterable[str]],
    ) -> None:
        """Bring `names` into the cache; `hashes` are those of SHA256SUMS."""
        self._fetch({name: f"sha256:{hashes[name]}" for name in names}, names, each)

    def _fetch(
        self,
        registry: Mapping[str, str | None],
        names: list[str],
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
        for name in each(names):
            try:
                fetcher.fetch(name, downloader=self._resuming)
            except (ValueError, requests.RequestException) as error:
                problem = f"cannot be fetched ({' '.join(str(error).split())[:200]})"
                raise DataError(urls[name], problem, AGAIN) from None

    def _resuming(self, url: str, output: Any, *_: object) -> None:
        """Download `url` to the path `output`, going on where an earlier attempt was cut off."""
        import requests

        part = self.cache / f".{hashlib.sha256(url.encode()).hexdigest()[:16]}.part"
        have = part.stat().st_size if part.is_file() else 0
        asked = {"Accept-Encoding": "identity"} | ({"Range": f"bytes={have}-"} if have else {})
        with _answer(url, asked) as answer:
            if have and answer.status_code == requests.codes.requested_range_not_satisfiable:
                part.unlink()
            answer.raise_for_status()
            goes_on = answer.status_code == requests.codes.partial_content
            with part.open("ab" if goes_on else "wb") as stream:
                for block in answer.iter_content(CHUNK_BYTES):
                    self.left -= len(block)
                    if self.left < 0:
                        part.unlink()
                        raise DataError(url, "is absurdly large", "do not use this data set")
                    stream.write(block)
        part.replace(output)


def _answer(url: str, headers: Mapping[str, str]) -> Response:
    """Return the answer to `url`, wherever that leads. Raises DataError for a way from https to
    anything else: who listens in could send other bytes."""
    import requests

    with requests.Session() as session:
        answer = session.get(
            url, stream=True, timeout=_TIMEOUT_S, headers=headers, allow_redirects=False
        )
        for _ in range(MAX_REDIRECTS):
            target = session.get_redirect_target(answer)
            if target is None:
                return answer
            answer.close()
            leads = urljoin(answer.url, target)
            if urlsplit(leads).scheme not in _ALLOWED[urlsplit(answer.url).scheme]:
                problem = f"leads to {leads[:200]}, which is not https"
                raise DataError(url, problem, "do not use it, or ask who keeps it for another one")
            answer = session.get(
                leads, stream=True, timeout=_TIMEOUT_S, headers=headers, allow_redirects=False
            )
    answer.close()
    raise DataError(url, f"leads on more than {MAX_REDIRECTS} times", "name where it ends")
