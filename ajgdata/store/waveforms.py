"""Recordings as one lazy array: a file is opened when its samples are used, not before."""

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
from ajgdata.store.features import Column, Shard, concatenate, text_column
from ajgdata.store.labels import labelled, select, with_columns
from ajgdata.store.session_audio import checked_sha256, label_rows
from ajgdata.store.sessions import audio_path, read_recordings, read_session
from ajgdata.types import AudioSettings, DataError, DatasetSpec, Finding


@dataclass(frozen=True)
class AudioSource:
    """A recording on disk; `frames` is its length at the declared rate, `sha256` may be empty."""

    path: Path
    sha256: str
    frames: int


class Waveforms(BackendArray):
    """Samples (recording, time), float32, full scale ±1; NaN after the end of a shorter one."""

    def __init__(self, sources: Sequence[AudioSource], audio: AudioSettings) -> None:
        self.sources, self.audio = tuple(sources), audio
        self.shape = (len(sources), max(source.frames for source in sources))
        self.dtype = np.dtype(np.float32)

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        """Return the samples that `key` selects."""
        outer = indexing.IndexingSupport.OUTER
        return indexing.explicit_indexing_adapter(key, self.shape, outer, self._read)

    def _read(self, key: tuple[Any, Any]) -> np.ndarray:
        rows, times = (np.arange(n)[part] for n, part in zip(self.shape, key, strict=True))
        result = np.full((rows.size, times.size), np.nan, np.float32)
        for out, row in zip(result, np.atleast_1d(rows), strict=True):
            source = self.sources[row]
            if source.sha256:
                checked_sha256(source.path, source.sha256)
            samples = read_audio(source.path, self.audio).samples
            is_present = np.atleast_1d(times) < len(samples)
            out[is_present] = samples[np.atleast_1d(times)[is_present]]
        return result.reshape(rows.shape + times.shape)


def open_recordings(
    folders: Sequence[Path], spec: DatasetSpec
) -> tuple[xr.Dataset | None, list[Finding]]:
    """Return the usable recordings of sessions with their labels, and the issues of recordings.

    No sample is read. `frames` is the number of samples of each recording. A label with the name of
    another coordinate gets `label_` before its name. Without usable recordings, the data set is
    None. Raises DataError when a session cannot be read.
    """
    sources: dict[str, AudioSource] = {}
    sessions = [_open_session(folder, spec, sources) for folder in folders]
    issues = [issue for _, some in sessions for issue in some]
    if not any(len(shard.feature) for shard, _ in sessions):
        return None, issues
    names = {name for shard, _ in sessions for name in shard.columns}
    shards = [with_columns(shard, names, spec.targets) for shard, _ in sessions]
    columns = concatenate(shards).columns
    used = [sources[str(name)] for name in columns["recording"].values]
    return _lazy(used, columns, spec.audio), issues


def _open_session(
    folder: Path, spec: DatasetSpec, sources: dict[str, AudioSource]
) -> tuple[Shard, list[Finding]]:
    """Return the labels of the usable recordings of a session, and issues; add to `sources`."""
    session = read_session(folder)
    recordings, issues = read_recordings(folder)
    table = {row["recording_id"]: row for row in label_rows(session, recordings)}
    hashes = {}
    for row in recordings:
        try:
            path = audio_path(folder, session, row)
            info = inspect_audio(path)
            check_layout(path, info, spec.audio)
        except DataError as error:
            names = (folder.name, row.recording_id, row.file)
            issues.append(Finding(*names, "error", "unusable", error.problem, error.fix))
            continue
        frames = math.ceil(info.frames * spec.audio.sample_rate_hz / info.sample_rate_hz)
        hashes[row.recording_id] = row.sha256
        sources[f"{folder.name}/{row.recording_id}"] = AudioSource(path, row.sha256, frames)
    columns = {
        "recording": text_column(list(hashes)),
        "sha256": text_column(list(hashes.values()), long_name="SHA-256 of the file"),
    }
    shard = Shard(np.empty((len(hashes), 0), np.float32), np.empty(0), columns, {})
    used, more = select(shard, table, spec.targets, folder.name)
    return labelled(used, table, spec.targets, folder.name), issues + more


def _lazy(
    sources: Sequence[AudioSource], columns: Mapping[str, Column], audio: AudioSettings
) -> xr.Dataset:
    """Return the lazy array with its time axis in seconds, and `columns` (n,) as coordinates."""
    lazy = Waveforms(sources, audio)
    time = np.arange(lazy.shape[1]) / audio.sample_rate_hz
    frames = np.asarray([source.frames for source in sources], np.int64)
    files = np.asarray([str(source.path) for source in sources], np.str_)
    coordinates: dict[str, Any] = {
        "time": ("time", time, {"units": "s", "long_name": "time since the recording began"}),
        "frames": ("recording", frames, {"units": "1", "long_name": "samples of the recording"}),
        "file": ("recording", files, {"long_name": "file"}),
    }
    taken = {*coordinates, "waveform"}
    for name, column in columns.items():
        values = ("recording", column.values, dict(column.attrs))
        coordinates[f"label_{name}" if name in taken else name] = values
    attrs = {"long_name": "sound pressure, full scale ±1", "units": "1"}
    waveform = xr.Variable(("recording", "time"), indexing.LazilyIndexedArray(lazy), attrs)
    return xr.Dataset({"waveform": waveform}, coordinates)
