"""Digests of code that processes before this one have found, kept beside the compiled sources.

Following names through all sources takes a second, and every process of the workflow does it. What
is kept holds for the same bytes of every file of the packages and for the same Python.
"""

from __future__ import annotations

import atexit
import hashlib
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from importlib.util import cache_from_source
from pathlib import Path

from ajgdata.store.files import json_bytes, read_json, write_bytes
from ajgdata.types import DataError

KEY = "sources_sha256"


class KeptDigests:
    """Digests by what they are of; new ones are written when the process ends.

    `folders` are those of the packages, or the file of a module alone, by name.
    """

    def __init__(self, folders: Mapping[str, Path], file: Path) -> None:
        self.folders, self.file = folders, file
        self._sources, self._is_new = sources_sha256(folders), False
        self._known = self._read()

    def of(self, entries: tuple[str, ...], found: Callable[[], str]) -> str:
        """Return the digest that is kept, else the one that `found` returns."""
        name = "|".join(entries)
        if name not in self._known:
            self._known[name] = found()
            if not self._is_new:
                atexit.register(self.write)
                self._is_new = True
        return self._known[name]

    def write(self) -> None:
        """Write all that is known, here and by others, unless the sources were edited meanwhile."""
        if sources_sha256(self.folders) == self._sources:
            content = {KEY: self._sources, "digests": self._read() | self._known}
            with suppress(OSError, DataError):  # an installed package may be read-only
                write_bytes(self.file, json_bytes(content))

    def _read(self) -> dict[str, str]:
        with suppress(DataError):
            content = read_json(self.file)
            if content.get(KEY) == self._sources:
                return dict(content.get("digests", {}))
        return {}


def kept_beside(source: Path, packages: tuple[str, ...]) -> Path:
    """Return where digests in some packages are kept: with what Python compiled `source` to."""
    compiled = Path(cache_from_source(str(source)))
    return compiled.with_name(f"digests.{'.'.join(packages)}.json")


def sources_sha256(folders: Mapping[str, Path]) -> str:
    """Return a hash of Python's version, and of names and bytes of all files of some packages."""
    digest = hashlib.sha256(sys.version.encode())
    for name, place in sorted(folders.items()):
        files = place.rglob("*") if place.is_dir() else [place]
        for file in sorted(one for one in files if one.parent.name != "__pycache__"):
            if file.is_file():
                content = file.read_bytes()
                where = f"{name}/{file.relative_to(place).as_posix()}\0{len(content)}\0"
                digest.update(where.encode() + content)
    return digest.hexdigest()
