"""Download of the files of a published data set."""

from __future__ import annotations

import logging
from pathlib import Path
from urllib.parse import quote

import pooch
import requests

from ajgdata.types import DataError

RUN_AGAIN = "run it again: complete files are kept"
#: Longest time without data from a server.
REQUEST_TIMEOUT_S = 30.0


def is_web(source: str) -> bool:
    """Return True for a web address. Raises DataError for an address of another kind."""
    scheme, separator, _ = source.partition("://")
    if separator and scheme.lower() not in ("http", "https"):
        problem = f"addresses that begin with {scheme}:// are not supported"
        raise DataError(source, problem, "use https, or name a folder")
    return bool(separator)


def download(address: str, folder: Path, name: str, sha256: str = "") -> None:
    """Download the file `name` below `address` into `folder`; `sha256` is its hash if it is known.

    pooch keeps a complete file, and downloads a missing or damaged file again. Raises DataError for
    a file that cannot be downloaded.
    """
    pooch.get_logger().setLevel(logging.ERROR)
    url = f"{address.rstrip('/')}/{quote(name)}"
    target = folder / name
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
