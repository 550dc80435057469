"""Download of one file with pooch, from a web address or from the deposit of a DOI."""

from __future__ import annotations

import logging
from pathlib import Path

import pooch
import requests

from ajgdata.store.addresses import without_credentials
from ajgdata.types import DataError

RUN_AGAIN = "run it again: complete files are kept"
#: Longest time without data from a server.
REQUEST_TIMEOUT_S = 30.0


def download(url: str, target: Path, sha256: str = "") -> None:
    """Download `url`, an address or `doi:DOI/FILE`, to `target`; `sha256` is its hash if known.

    pooch keeps a complete file, and downloads a missing or damaged file again. Raises DataError for
    a file that cannot be downloaded.
    """
    pooch.get_logger().setLevel(logging.ERROR)
    is_doi = url.startswith("doi:")
    downloader = pooch.DOIDownloader if is_doi else pooch.HTTPDownloader
    if not sha256:
        target.unlink(missing_ok=True)
    try:
        pooch.retrieve(
            url,
            f"sha256:{sha256}" if sha256 else None,
            fname=target.name,
            path=target.parent,
            downloader=downloader(timeout=REQUEST_TIMEOUT_S),
        )
    except (ValueError, LookupError, requests.RequestException) as error:
        # LookupError: the answer of a repository has another form than pooch expects.
        reason = without_credentials(" ".join(str(error).split()))
        problem = f"cannot be fetched ({reason[:200]})"
        raise DataError(without_credentials(url), problem, RUN_AGAIN) from None
