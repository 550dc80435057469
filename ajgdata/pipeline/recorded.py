"""Sessions on disk -> takes with their labels, without reading a sample."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ajgdata.paths import Paths
from ajgdata.pipeline.plan import recorded_sessions
from ajgdata.store.features import Column, Shard, concatenate, text_column
from ajgdata.store.labels import labelled, select, with_columns
from ajgdata.store.manifest import label_rows
from ajgdata.store.sessions import audio_path, read_recordings, read_session
from ajgdata.store.waveforms import Take, look
from ajgdata.types import DataError, DatasetSpec, Finding


def recorded(
    paths: Paths, spec: DatasetSpec
) -> tuple[list[Take], Mapping[str, Column], list[Finding]]:
    """Every recording of a data set that its header and labels let one use, with its labels as the
    feature store has them; and a finding for each that is left out.

    Raises DataError when there is none, or when a session cannot be read.
    """
    takes: list[Take] = []
    parts: list[Shard] = []
    told: list[Finding] = []
    for name in recorded_sessions(paths, spec):
        folder = paths.session(spec.name, name)
        found, part, left_out = _session(folder, spec)
        takes, parts, told = takes + found, [*parts, part], told + left_out
    if not takes:
        fix = f"get some with `ajgdata import FOLDER --dataset {spec.name}` or `ajgdata acquire`"
        raise DataError(paths.sessions(spec.name), "holds no recording that can be used", fix)
    columns = {name for part in parts for name in part.columns}
    joined = concatenate([with_columns(part, columns, spec.targets) for part in parts])
    return takes, joined.columns, told


def _session(folder: Path, spec: DatasetSpec) -> tuple[list[Take], Shard, list[Finding]]:
    session = read_session(folder)
    recordings, told = read_recordings(folder)
    table = {row["recording_id"]: row for row in label_rows(session, recordings)}
    takes = {}
    for one in recordings:
        try:
            takes[one.recording_id] = look(audio_path(folder, session, one), one.sha256, spec.audio)
        except DataError as error:
            told.append(
                Finding(
                    folder.name, one.recording_id, one.file, "error",
                    "unusable", error.problem, error.fix,
                )
            )  # fmt: skip
    columns = {
        "recording": text_column(list(takes)),
        "sha256": text_column([t.sha256 for t in takes.values()], long_name="SHA-256 of the file"),
    }
    shard = Shard(np.empty((len(takes), 0), np.float32), np.empty(0), columns, {})
    kept, more = select(shard, table, spec.targets, folder.name)
    used = [takes[str(name)] for name in kept.columns["recording"].values]
    return used, labelled(kept, table, spec.targets, folder.name), told + more
