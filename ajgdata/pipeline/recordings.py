"""Recordings -> samples fit for a feature, with everything that was found on the way.

The one place that decides whether a recording can be used: the workflow and `ajgdata check`
both come through here.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ajgdata.features.checks import check_audio
from ajgdata.paths import Paths
from ajgdata.store.audio import AudioError, Remark, read_audio
from ajgdata.store.session_audio import checked_sha256
from ajgdata.store.sessions import audio_path, read_recordings, read_session
from ajgdata.types import AudioSettings, DataError, Finding, NotPossibleError, Recording, Session


@dataclass(frozen=True)
class Examined:
    """Samples (n,) float32, None if the recording cannot be used, remarks, and the levels of the
    channels of its file in dB of full scale."""

    samples: np.ndarray | None
    remarks: tuple[Remark, ...]
    levels_db: tuple[float, ...] = ()


def examine(
    path: Path, audio: AudioSettings, window: int, band_hz: tuple[float, float] | None = None
) -> Examined:
    """Read and check one recording; its feature has windows of `window` samples, and the bins of
    `band_hz`."""
    try:
        read = read_audio(path, audio)
    except AudioError as error:
        return Examined(None, (error.remark,))
    remarks = tuple(check_audio(read, window, band_hz))
    if errors := tuple(remark for remark in remarks if remark.level == "error"):
        return Examined(None, errors)  # what else is odd about it no longer matters
    return Examined(read.samples, remarks, read.levels_db)


class RecordingReader:
    """Samples of recordings of several data sets, and what was played to them.

    `audio` says how the recordings of each data set are read.
    """

    def __init__(self, paths: Paths, audio: Mapping[str, AudioSettings]) -> None:
        self._paths, self._audio = paths, dict(audio)
        self._sessions: dict[tuple[str, str], tuple[Session, dict[str, Recording]]] = {}

    def samples(self, dataset: str, names: Sequence[str], window: int) -> Iterator[np.ndarray]:
        """Yield the samples (n,) of recordings of a data set, fit for windows of that length.

        Raises NotPossibleError for one that cannot be used, or that was edited.
        """
        for name in names:
            session, _, recording_id = name.partition("/")
            declared, rows = self._session(dataset, session)
            row, folder = rows[recording_id], self._paths.session(dataset, session)
            try:
                path = audio_path(folder, declared, row)
                checked_sha256(path, row.sha256, dataset)
            except DataError as error:
                raise NotPossibleError(f"recording {name!r}: {error.problem}") from None
            samples = examine(path, self._audio[dataset], window).samples
            if samples is None:
                problem = f"recording {name!r} cannot be used with a window of {window}"
                raise NotPossibleError(
                    f"{problem}: see its data set's quarantine, or lower the window"
                )
            yield samples

    def _session(self, dataset: str, session: str) -> tuple[Session, dict[str, Recording]]:
        if (dataset, session) not in self._sessions:
            folder = self._paths.session(dataset, session)
            rows = {row.recording_id: row for row in read_recordings(folder)[0]}
            self._sessions[dataset, session] = read_session(folder), rows
        return self._sessions[dataset, session]


def finding(session: str, recording_id: str, path: Path, remark: Remark) -> Finding:
    """A remark, with the recording it is about."""
    return Finding(session, recording_id, path.name, *remark)
