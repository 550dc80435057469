"""SHA256SUMS: what belongs to a published data set, in the format of `sha256sum -c`."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

from ajgdata.paths import Tree
from ajgdata.store.audio import file_sha256
from ajgdata.store.files import read_text
from ajgdata.store.publishing.archive import bad_name
from ajgdata.types import DataError

_LINE = re.compile(r"([0-9a-f]{64})  (.+)")


def files_of(root: Path) -> list[str]:
    """Return every file and link below `root`, by name, except SHA256SUMS itself."""
    files = (p for p in root.rglob("*") if p.is_symlink() or not p.is_dir())
    return sorted({p.relative_to(root).as_posix() for p in files} - {Tree.SUMS})


def checksums_bytes(root: Path) -> bytes:
    """Return SHA256SUMS of a tree."""
    lines = [f"{file_sha256(root / name)}  {name}\n" for name in files_of(root)]
    return "".join(lines).encode()


def is_web_page(content: bytes) -> bool:
    """Return True for the beginning of an HTML page."""
    return content.lstrip()[:14].lower().startswith((b"<!doctype html", b"<html"))


def read_checksums(path: Path) -> dict[str, str]:
    """Return hashes by file name.

    Raises DataError for a web page, an invalid line, a name that would leave the tree, and a name
    that is listed twice (ignoring case).
    """
    hashes: dict[str, str] = {}
    text = read_text(path)
    if is_web_page(text.encode()):
        problem = "is a web page (HTML), not a list of hashes"
        raise DataError(path, problem, "download the file itself, not the page that shows it")
    lines = text.splitlines()
    for number, line in enumerate(lines, 1):
        where = f"{path}:{number}"
        if not (match := _LINE.fullmatch(line)):
            raise DataError(where, "is no `sha256  name`", "publish the data set again")
        digest, name = match.groups()
        if problem := bad_name(name):
            raise DataError(where, f"{name!r} {problem}", "do not use this data set")
        hashes[name] = digest
    counts = Counter(name.lower() for name in hashes)
    if doubled := [name for name in hashes if counts[name.lower()] > 1]:
        raise DataError(path, f"{doubled[0]!r} stands twice", "publish the data set again")
    if len(lines) != len(hashes):
        raise DataError(path, "a file stands twice", "publish the data set again")
    if not hashes:
        raise DataError(path, "names no files", "publish the data set again")
    return hashes
