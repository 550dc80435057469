"""Recordings of several data sets by name, for experiments that hear them again."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from ajgdata.store.manifest import read_manifest
from ajgdata.types import AudioSettings, NotPossibleError


class RecordingReader:
    """Samples of recordings, and what was played to them; `manifests`, read once, and settings of
    audio by data set."""

    def __init__(
        self,
        root: Path,
        manifests: Mapping[str, Sequence[Path]],
        audio: Mapping[str, AudioSettings],
    ) -> None:
        self._root, self._audio = root, dict(audio)
        self._manifests: dict[tuple[str, str], dict] = {}
        self._where: dict[tuple[str, str], str] = {}
        self._played: dict[tuple[str, str], np.ndarray | None] = {}
        for dataset, paths in manifests.items():
            for content in (read_manifest(path)[0] for path in paths):
                session = content["session_id"]
                self._manifests[dataset, session] = content
                for entry in content["recordings"]:
                    self._where[dataset, f"{session}/{entry['recording_id']}"] = entry["path"]

    def samples(self, dataset: str, names: Sequence[str], window: int) -> Iterator[np.ndarray]:
        """Yield the samples (n,) of recordings of a data set, fit for windows of that length.

        Raises NotPossibleError for one that cannot be used.
        """
        from ajgdata.pipeline.recordings import examine

        for name in names:
            path = self._root / self._where[dataset, name]
            found = examine(path, self._audio[dataset], window).samples
            if found is None:
                problem = f"recording {name!r} cannot be used with a window of {window}"
                raise NotPossibleError(
                    f"{problem}: see its data set's quarantine, or lower the window"
                )
            yield found

    def played(self, dataset: str, name: str) -> np.ndarray | None:
        """Return what was played (m,) to a recording; None where its session does not have it."""
        from ajgdata.pipeline.recordings import read_excitation

        content = self._manifests[dataset, name.partition("/")[0]]
        key = dataset, content["excitation"]["sha256"] if content["excitation"] else ""
        if key not in self._played:
            self._played[key] = read_excitation(self._root, content, self._audio[dataset])[0]
        return self._played[key]
