"""A few recordings of a task that its page plays: the files themselves, or nothing."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ajgdata.paths import SOUNDS, Paths
from ajgdata.report.format import value, with_unit, words
from ajgdata.report.report_data import Clip
from ajgdata.store.audio import inspect_audio
from ajgdata.store.features import Shard
from ajgdata.store.files import sha256_of, write_bytes
from ajgdata.store.sessions import recording_paths
from ajgdata.types import DataError, DatasetSpec

#: Suffix by container, which is how a browser knows them; every one plays these.
SUFFIXES = {"FLAC": ".flac", "OGG": ".ogg"}
MAX_CLIPS = 6


def clips_of(
    paths: Paths, spec: DatasetSpec, store: Shard, folder: Path, task: str
) -> tuple[Clip, ...]:
    """Copy the first recording of each class, or of evenly spaced values, into `folder`.

    There are at most MAX_CLIPS. A recording that is missing or changed since its features were
    computed is skipped.
    """
    settings = spec.task_settings(task)
    clips = []
    for row in _chosen(store, settings["target"], settings.get("classes", ())):
        name = str(store.columns["recording"].values[row])
        shown = words(value(store.columns[settings["target"]].values[row].item()))
        if file := _copied(paths, spec.name, store, row, folder):
            clips.append(Clip(name, with_unit(shown, settings["unit"]), f"{SOUNDS}/{file}"))
    return tuple(clips)


def _chosen(store: Shard, target: str, classes: Sequence[str]) -> list[int]:
    """Return the row of the first recording, by name, of each of at most MAX_CLIPS values."""
    if target not in store.columns or not len(store.feature):
        return []
    values = store.columns[target].values
    known = values != "" if values.dtype.kind == "U" else np.isfinite(values)
    known &= np.isin(values, classes) if classes else True
    distinct = np.unique(values[known])
    places = np.linspace(0, len(distinct) - 1, min(MAX_CLIPS, len(distinct))).round().astype(int)
    names = store.columns["recording"].values
    rows = (np.flatnonzero(values == distinct[place]) for place in places)
    return [int(min(some, key=lambda row: names[row])) for some in rows]


def _copied(paths: Paths, dataset: str, store: Shard, row: int, folder: Path) -> str:
    """Copy a recording, byte for byte, and return its name in `folder`; none if it is gone."""
    session, _, recording = str(store.columns["recording"].values[row]).partition("/")
    digest = str(store.columns["sha256"].values[row])
    try:
        path = recording_paths(paths.session(dataset, session))[recording]
        suffix = SUFFIXES.get(inspect_audio(path).format, ".wav")
        sound = path.read_bytes()
    except (DataError, LookupError, OSError):
        return ""
    if sha256_of(sound) != digest:
        return ""
    name = f"{dataset}--{digest[:16]}{suffix}"
    write_bytes(folder / name, sound)
    return name
