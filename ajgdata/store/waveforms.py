"""Recordings as one lazy array: a file is opened when samples of it are asked for, not before."""

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

from ajgdata.store.audio import (
    check_layout,
    inspect_audio,
    read_audio,
)
from ajgdata.store.features import Column, Shard, concatenate, text_column
from ajgdata.store.labels import labelled, select, with_columns
from ajgdata.store.session_audio import checked_sha256, label_rows
from ajgdata.store.sessions import audio_path, read_recordings, read_session
from ajgdata.types import AudioSettings, DataError, DatasetSpec, Finding


@dataclass(frozen=True)
class Take:
    """One recording on disk. `frames` is its length at the declared rate; `sha256` may be empty."""

    path: Path
    sha256: str
    frames: int


def look(path: Path, sha256: str, audio: AudioSettings) -> Take:
    """Return a recording's length, from its header alone. Raises AudioError."""
    info = inspect_audio(path)
    check_layout(path, info, audio)
    return Take(path, sha256, math.ceil(info.frames * audio.sample_rate_hz / info.sample_rate_hz))


class Waveforms(BackendArray):
    """Samples (recording, time), float32, full scale ±1; NaN after the end of a shorter one."""

    def __init__(self, takes: Sequence[Take], audio: AudioSettings) -> None:
        self.takes, self.audio = tuple(takes), audio
        self.shape = (len(self.takes), max((take.frames for take in self.takes), default=0))
        self.dtype = np.dtype(np.float32)

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        """Return the samples that `key` picks."""
        outer = indexing.IndexingSupport.OUTER
        return indexing.explicit_indexing_adapter(key, self.shape, outer, self._read)

    def _read(self, key: tuple[Any, Any]) -> np.ndarray:
        rows, times = (np.arange(n)[one] for n, one in zip(self.shape, key, strict=True))
        read = np.full((rows.size, times.size), np.nan, np.float32)
        for out, row in zip(read, np.atleast_1d(rows), strict=True):
            samples = self._samples(self.takes[row])
            there = np.atleast_1d(times) < len(samples)
            out[there] = samples[np.atleast_1d(times)[there]]
        return read.reshape(rows.shape + times.shape)

    def _samples(self, take: Take) -> np.ndarray:
        """Return all samples (n,) of one file, which must be the one that was recorded."""
        if take.sha256:
            checked_sha256(take.path, take.sha256)
        return read_audio(take.path, self.audio).samples


def waveforms(
    takes: Sequence[Take], columns: dict[str, Column], audio: AudioSettings, attrs: dict[str, str]
) -> xr.Dataset:
    """Return the lazy array of `takes` with its time axis in seconds, and `columns` (n,) as
    coordinates.

    `frames` says how many samples each recording has. A label that has the name of something here
    gets `label_` before it.
    """
    lazy = Waveforms(takes, audio)
    time = np.arange(lazy.shape[1]) / audio.sample_rate_hz
    frames = np.asarray([take.frames for take in takes], np.int64)
    files = np.asarray([str(take.path) for take in takes], np.str_)
    coordinates: dict[str, Any] = {
        "time": ("time", time, {"units": "s", "long_name": "time since the recording began"}),
        "frames": ("recording", frames, {"units": "1", "long_name": "samples of the recording"}),
        "file": ("recording", files, {"long_name": "file"}),
    }
    taken = {*coordinates, "waveform"}
    for name, column in columns.items():
        values = ("recording", column.values, dict(column.attrs))
        coordinates[f"label_{name}" if name in taken else name] = values
    rate = {"sample_rate_hz": audio.sample_rate_hz}
    variable = xr.Variable(
        ("recording", "time"),
        indexing.LazilyIndexedArray(lazy),
        {"long_name": "sound pressure, full scale ±1", "units": "1"},
    )
    return xr.Dataset({"waveform": variable}, coordinates, {**attrs, **rate})


def takes_of(
    folders: Sequence[Path], spec: DatasetSpec
) -> tuple[list[Take], Mapping[str, Column], list[Finding]]:
    """Return every recording of sessions that header and labels let one use, its labels (n,) by
    column as the feature store has them, and the issues of recordings.

    No sample is read. Raises DataError when a session cannot be read.
    """
    parts = [_takes_of_session(folder, spec) for folder in folders]
    takes = [take for used, _, _ in parts for take in used]
    findings = [finding for _, _, issues in parts for finding in issues]
    columns = {name for _, part, _ in parts for name in part.columns}
    shards = [with_columns(part, columns, spec.targets) for _, part, _ in parts]
    return takes, concatenate(shards).columns if takes else {}, findings


def _takes_of_session(folder: Path, spec: DatasetSpec) -> tuple[list[Take], Shard, list[Finding]]:
    session = read_session(folder)
    recordings, findings = read_recordings(folder)
    table = {row["recording_id"]: row for row in label_rows(session, recordings)}
    takes = {}
    for row in recordings:
        try:
            path = audio_path(folder, session, row)
            takes[row.recording_id] = look(path, row.sha256, spec.audio)
        except DataError as error:
            issue = ("error", "unusable", error.problem, error.fix)
            findings.append(Finding(folder.name, row.recording_id, row.file, *issue))  # type: ignore[arg-type]  # the level above
    columns = {
        "recording": text_column(list(takes)),
        "sha256": text_column([t.sha256 for t in takes.values()], long_name="SHA-256 of the file"),
    }
    shard = Shard(np.empty((len(takes), 0), np.float32), np.empty(0), columns, {})
    kept, issues = select(shard, table, spec.targets, folder.name)
    used = [takes[str(name)] for name in kept.columns["recording"].values]
    return used, labelled(kept, table, spec.targets, folder.name), findings + issues
