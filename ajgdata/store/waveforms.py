"""Recordings as one lazy array, which opens a file only when its samples are used."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from ajgdata.store.audio import check_layout, inspect_audio, read_audio
from ajgdata.store.feature_array import channel_axis
from ajgdata.store.features import FeatureColumn, text_column
from ajgdata.store.findings import is_rejected
from ajgdata.store.labels import bad_labels, label_columns
from ajgdata.store.session_audio import checked_sha256, label_rows
from ajgdata.store.sessions import audio_path, read_recordings, read_session
from ajgdata.types import (
    AudioSettings,
    DataError,
    DatasetSpec,
    Finding,
    Recording,
    Segment,
    Session,
)


@dataclass(frozen=True)
class AudioSource:
    """A recording on disk; `frames` is its length at the declared rate, `sha256` of its file can be
    empty."""

    path: Path
    sha256: str
    frames: int
    segment: Segment


class Waveforms(BackendArray):
    """Samples (recording, channel, time), float32, full scale ±1; NaN after the end of a recording.

    Without a list of microphones, there is no dimension `channel`.
    """

    def __init__(self, sources: Sequence[AudioSource], audio: AudioSettings) -> None:
        self.sources = tuple(sources)
        self.audio = audio
        channels = (len(audio.microphones),) if isinstance(audio.microphone, tuple) else ()
        self.shape = (len(sources), *channels, max(source.frames for source in sources))
        self.dtype = np.dtype(np.float32)

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        """Return the samples that `key` selects."""
        outer = indexing.IndexingSupport.OUTER
        return indexing.explicit_indexing_adapter(key, self.shape, outer, self._read)

    def _read(self, key: tuple[Any, ...]) -> np.ndarray:
        """Return the samples of the recordings, channels and times in `key`: numbers, slices or
        arrays."""
        recordings = np.arange(self.shape[0])[key[0]]
        times = np.arange(self.shape[-1])[key[-1]]
        channels = np.arange(len(self.audio.microphones))[key[1] if len(key) == 3 else 0]
        result = np.full((recordings.size, channels.size, times.size), np.nan, np.float32)
        unchanged: set[tuple[Path, str]] = set()
        for row, recording in zip(result, np.atleast_1d(recordings), strict=True):
            source = self.sources[recording]
            file = (source.path, source.sha256)
            if source.sha256 and file not in unchanged:
                checked_sha256(*file)
                unchanged.add(file)
            samples = np.atleast_2d(read_audio(source.path, self.audio, source.segment).samples)
            used = samples[np.atleast_1d(channels)]
            is_present = np.atleast_1d(times) < samples.shape[1]
            row[:, is_present] = used[:, np.atleast_1d(times)[is_present]]
        return result.reshape(recordings.shape + channels.shape + times.shape)


def open_recordings(
    folders: Sequence[Path], spec: DatasetSpec
) -> tuple[xr.Dataset | None, list[Finding]]:
    """Return the usable recordings of sessions with their labels, and the issues of recordings.

    No sample is read. The coordinate `frames` is the number of samples of each recording. A label
    with the name of another coordinate gets the prefix `label_`. The data set is None if there are
    no usable recordings. Raises DataError if a session cannot be read.
    """
    sources: list[AudioSource] = []
    rows: list[dict[str, str]] = []
    names: set[str] = set()
    issues: list[Finding] = []
    targets = spec.label_targets
    for folder in folders:
        session = read_session(folder)
        recordings, row_issues = read_recordings(folder)
        issues += row_issues
        for row, recording in zip(label_rows(session, recordings), recordings, strict=True):
            names.update(row)
            if is_rejected(row):
                continue
            try:
                sources.append(_source(folder, session, recording, spec.audio))
            except DataError as error:
                where = (folder.name, recording.recording_id, recording.file)
                issues.append(Finding(*where, "error", "unusable", error.problem, error.fix))
                continue
            rows.append({**row, "session_id": folder.name})
            issues += bad_labels(folder.name, recording.recording_id, row, targets)
    if not rows:
        return None, issues
    hashes = text_column([source.sha256 for source in sources], long_name="SHA-256 of the file")
    columns = {**label_columns(rows, names, targets), "sha256": hashes}
    return _lazy(sources, columns, spec.audio), issues


def _source(
    folder: Path, session: Session, recording: Recording, audio: AudioSettings
) -> AudioSource:
    """Return a recording on disk. Raises DataError if its file cannot be used."""
    path = audio_path(folder, session, recording)
    info = inspect_audio(path, recording.segment)
    check_layout(path, info, audio)
    frames = math.ceil(info.frames * audio.sample_rate_hz / info.sample_rate_hz)
    return AudioSource(path, recording.sha256, frames, recording.segment)


def _lazy(
    sources: Sequence[AudioSource], columns: Mapping[str, FeatureColumn], audio: AudioSettings
) -> xr.Dataset:
    """Return the lazy array with its time axis in seconds, and `columns` (n,) as coordinates."""
    lazy = Waveforms(sources, audio)
    time = np.arange(lazy.shape[-1]) / audio.sample_rate_hz
    frames = np.asarray([source.frames for source in sources], np.int64)
    files = np.asarray([str(source.path) for source in sources], np.str_)
    coordinates: dict[str, Any] = {
        "time": ("time", time, {"units": "s", "long_name": "time since the recording began"}),
        "frames": ("recording", frames, {"units": "1", "long_name": "samples of the recording"}),
        "file": ("recording", files, {"long_name": "file"}),
    }
    dimensions = ["recording", "time"]
    if isinstance(audio.microphone, tuple):
        channel = channel_axis(audio.microphone)
        dimensions.insert(1, channel.name)
        coordinates[channel.name] = (channel.name, channel.values, dict(channel.attrs))
    used_names = {*coordinates, "waveform"}
    for name, column in columns.items():
        values = ("recording", column.values, dict(column.attrs))
        coordinates[f"label_{name}" if name in used_names else name] = values
    attrs = {"long_name": "sound pressure, full scale ±1", "units": "1"}
    waveform = xr.Variable(dimensions, indexing.LazilyIndexedArray(lazy), attrs)
    return xr.Dataset({"waveform": waveform}, coordinates)
