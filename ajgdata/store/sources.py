"""Public recordings by name: what source.yaml says, and the recordings themselves."""

from __future__ import annotations

import errno
from collections.abc import Callable, Iterable
from pathlib import Path
from urllib.parse import urlsplit

from pydantic import ValidationError

from ajgdata.paths import SOURCE_FILE, Paths, brought
from ajgdata.store.files import line_of, read_yaml
from ajgdata.store.git_folders import AGAIN, GitFolders
from ajgdata.store.publishing.download import Download
from ajgdata.types import DataError, GitOrigin, Source, describe, location

Each = Callable[[list[str]], Iterable[str]]


def list_sources(paths: Paths) -> list[str]:
    """Return the names of the data sets that can be fetched by name."""
    return sorted(file.parent.name for file in paths.datasets.glob(f"*/{SOURCE_FILE}"))


def read_source(paths: Paths, dataset: str) -> Source:
    """Return where a data set is brought from; DataError names file, line, key, value and fix."""
    path = paths.source(dataset)
    if not path.is_file():
        known = ", ".join(list_sources(paths)) or "none"
        raise DataError(path, "there is no such file", f"these can be fetched by name: {known}")
    try:
        return Source.model_validate(read_yaml(path))
    except ValidationError as error:
        line = line_of(path, location(error))
        raise describe(error, f"{path}:{line}") from None


def address_of(source: Source, mirror: str = "") -> str:
    """Return the address of a source; `mirror` takes the place of its scheme and host."""
    origin = source.origin
    address = origin.repository if isinstance(origin, GitOrigin) else origin.address
    return mirror.rstrip("/") + urlsplit(address).path if mirror else address


def bring(dataset: str, source: Source, *, mirror: str, each: Each) -> Path:
    """Return the folder with the recordings of a source, whole and with the right hashes.

    `each` goes through the files that are fetched. Interrupted, it goes on there.
    """
    folder, origin = brought(dataset), source.origin
    address = address_of(source, mirror)
    try:
        if isinstance(origin, GitOrigin):
            objects = folder.with_name(f"{dataset}.git")
            GitFolders(address, folder, objects).bring(origin.parts, each)
        else:
            Download(address, folder).files(origin.files, sorted(origin.files), each)
    except OSError as error:
        fix = f"make it writable, then {AGAIN}"
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            fix = f"make room, or let AJGDATA_CACHE name a folder on another disk, then {AGAIN}"
        where = error.filename or folder
        raise DataError(where, f"cannot be written ({error.strerror})", fix) from None
    return folder
