"""Which sessions were found in order, so that as long as nothing of them changes none is read."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Collection, Mapping
from pathlib import Path

from ajgdata.paths import RECORDINGS_FILE, SESSION_FILE, Paths
from ajgdata.store.provenance import layer_hash
from ajgdata.store.files import json_bytes, read_json, sha256_of, write_bytes
from ajgdata.store.hashes import Mark, absolute, is_settled, mark_of
from ajgdata.types import DataError

#: What tells of a session in which nothing can be told from its files alone.
_UNTOLD = (OSError, DataError, LookupError, TypeError, ValueError)


class Surveyed:
    """Sessions of a data set that were found in order, with a digest of all that shows that they
    are still: their manifests, and size, times and inode of each of their files."""

    def __init__(self, paths: Paths, dataset: str) -> None:
        self.paths, self.dataset = paths, dataset
        self._code = layer_hash("features")
        self._file = paths.surveyed(dataset)
        self._before = _read(self._file)
        self._now = dict(self._before)

    def is_current(self, session: str) -> bool:
        """Return True if nothing of a session has changed since its manifests were written."""
        if session not in self._before:
            return False
        try:
            return self._before[session] == self._digest(session, mark_of)
        except _UNTOLD:
            return False

    def marks_of_tables(self, session: str) -> dict[str, Mark]:
        """Return the marks of what a survey reads first; none where one is not there."""
        try:
            return {file: mark_of(file) for file in self._tables(session)}
        except OSError:
            return {}

    def note(self, session: str, marks: Mapping[str, Mark]) -> None:
        """Keep that a session was surveyed, if all in it is in order and was left alone for a
        while. `marks` are those of its files, by absolute path, taken before they were read."""
        now = time.time_ns()

        def settled(file: str) -> Mark:
            if not is_settled(marks[file], now):
                raise LookupError(file)
            return marks[file]

        self._now.pop(session, None)
        try:
            self._now[session] = self._digest(session, settled)
        except _UNTOLD:
            return  # surveyed again the next time

    def save(self, sessions: Collection[str]) -> None:
        """Write what is known of `sessions`, if that changed."""
        kept = {name: digest for name, digest in self._now.items() if name in sessions}
        if kept != self._before:
            write_bytes(self._file, json_bytes(kept))

    def _tables(self, session: str) -> list[str]:
        folder = self.paths.session(self.dataset, session)
        return [absolute(folder / name) for name in (SESSION_FILE, RECORDINGS_FILE)]

    def _digest(self, session: str, mark: Callable[[str], Mark]) -> str:
        """Return what tells one state of a session from another.

        Raises LookupError for one with findings, which may depend on what is elsewhere, and what
        reading its files raises.
        """
        content = self.paths.audio_manifest(self.dataset, session).read_bytes()
        labels = self.paths.label_manifest(self.dataset, session).read_bytes()
        held = json.loads(content)
        if any(told["code"] != "skipped" for told in held["findings"]):
            raise LookupError(session)
        root = absolute(self.paths.root)
        named = [*held["recordings"], *([held["excitation"]] if held["excitation"] else [])]
        files = [absolute(os.path.join(root, one["path"])) for one in named]  # noqa: PTH118
        marks = [mark(file) for file in (*self._tables(session), *files)]
        said = [root, self._code, sha256_of(content), sha256_of(labels), marks]
        return sha256_of(json.dumps(said).encode())


def _read(path: Path) -> dict[str, str]:
    """Return what is known of sessions; nothing if it cannot be read."""
    try:
        known = read_json(path)
    except DataError:
        return {}
    return known if isinstance(known, dict) else {}
