"""Read recordings and check whether they can be used.

The workflow and `ajgdata check` both use this module, so they agree on usable recordings.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from ajgdata.features.checks import check_audio
from ajgdata.paths import Paths
from ajgdata.store.audio import AudioError, FileHashes, Remark, read_audio
from ajgdata.store.session_audio import (
    PlayedFile,
    check_unchanged,
    checked_sha256,
    played_file,
)
from ajgdata.store.sessions import audio_path, read_recordings, read_session
from ajgdata.types import (
    WHOLE_FILE,
    AudioSettings,
    DataError,
    Finding,
    NotPossibleError,
    Recording,
    Segment,
    Session,
)
from ajgdata.types.features import ALL_HZ, Band
from ajgdata.types.settings import numbers_of


@dataclass(frozen=True)
class Examined:
    """A recording that was read and checked.

    `samples`, see `store.audio.Audio`, are float32, and None if the recording cannot be used.
    `levels_db` are the levels of the channels of the file in dB of full scale.
    """

    samples: np.ndarray | None
    remarks: tuple[Remark, ...]
    levels_db: tuple[float, ...] = ()


def examine(
    path: Path,
    audio: AudioSettings,
    least_samples: int,
    lines_hz: Band = ALL_HZ,
    segment: Segment = WHOLE_FILE,
) -> Examined:
    """Read and check one recording, a file or a segment of it, for a feature."""
    try:
        read = read_audio(path, audio, segment)
    except AudioError as error:
        return Examined(None, (error.remark,))
    microphones = numbers_of(audio.microphone)
    remarks = tuple(check_audio(read, least_samples, lines_hz, microphones))
    errors = tuple(remark for remark in remarks if remark.level == "error")
    if errors:
        return Examined(None, errors)
    return Examined(read.samples, remarks, read.levels_db)


@lru_cache(maxsize=4)
def played_samples(played: PlayedFile | None, sample_rate_hz: int) -> np.ndarray:
    """Return the samples (m,) of the sound that a session played.

    Raises ValueError if the session has no such file, if the file was changed, and for another
    sample rate.
    """
    if played is None:
        raise ValueError("the session has no played sound: set features.reference to a microphone")
    try:
        checked_sha256(*played)
        audio = AudioSettings(sample_rate_hz=sample_rate_hz, other_rate="resample")
        return read_audio(played.path, audio).samples
    except DataError as error:
        raise ValueError(f"played sound {played.path.name}: {error.problem}") from None


class RecordingReader:
    """Reads samples of recordings of several data sets; `audio` has the settings of each."""

    def __init__(self, paths: Paths, audio: Mapping[str, AudioSettings]) -> None:
        self._paths = paths
        self._audio = dict(audio)
        self._sessions: dict[tuple[str, str], tuple[Session, dict[str, Recording]]] = {}

    def samples(
        self,
        dataset: str,
        names: Sequence[str],
        least_samples: int,
        hashes: FileHashes | None = None,
    ) -> Iterator[np.ndarray]:
        """Yield the samples of recordings of a data set, which have at least `least_samples`.

        Several calls with the same `hashes` read each file once to check it. Raises
        NotPossibleError for a recording that cannot be used, or whose file was edited.
        """
        if hashes is None:
            hashes = FileHashes()
        for name in names:
            session, _, recording_id = name.partition("/")
            declared, rows = self._session(dataset, session)
            row = rows[recording_id]
            if row.table_row is not None:
                raise NotPossibleError(f"recording {name!r} is a row of a table, without sound")
            folder = self._paths.session(dataset, session)
            try:
                path = audio_path(folder, declared, row)
                check_unchanged(path, hashes[path], row.sha256, dataset)
            except DataError as error:
                raise NotPossibleError(f"recording {name!r}: {error.problem}") from None
            audio = self._audio[dataset]
            samples = examine(path, audio, least_samples, segment=row.segment).samples
            if samples is None:
                raise NotPossibleError(
                    f"recording {name!r} cannot be used with a feature of {least_samples} samples: "
                    "see its data set's quarantine, or change the feature"
                )
            yield samples

    def played(self, dataset: str, name: str) -> np.ndarray:
        """Return the samples (m,) of the sound that the session of a recording played.

        Raises NotPossibleError if the session has no such sound, or if its file was edited.
        """
        session, _, _ = name.partition("/")
        declared, _ = self._session(dataset, session)
        file = played_file(self._paths.session(dataset, session), declared)
        try:
            return played_samples(file, self._audio[dataset].sample_rate_hz)
        except ValueError as error:
            raise NotPossibleError(f"recording {name!r}: {error}") from None

    def _session(self, dataset: str, session: str) -> tuple[Session, dict[str, Recording]]:
        """Return a session and its rows by recording_id, which are read once."""
        if (dataset, session) not in self._sessions:
            folder = self._paths.session(dataset, session)
            rows = {row.recording_id: row for row in read_recordings(folder)[0]}
            self._sessions[dataset, session] = read_session(folder), rows
        return self._sessions[dataset, session]


def finding(session: str, recording_id: str, path: Path, remark: Remark) -> Finding:
    """Return a remark as an issue of its recording."""
    return Finding(session, recording_id, path.name, *remark)


def no_feature(session: str, recording_id: str, error: ValueError) -> Finding:
    """Return the error of a usable recording that has no feature with the settings."""
    fix = "change features in dataset.yaml, or set quality to reject"
    return Finding(session, recording_id, "", "error", "no_feature", str(error), fix)
