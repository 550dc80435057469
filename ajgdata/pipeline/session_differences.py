"""Comparison of a feature file with the sessions from which it was computed.

A published data set contains both: labels in `features.nc` and `metadata.csv`, and the tables of
the sessions. They must be equal.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

from ajgdata.acquire.recipe import session_names
from ajgdata.paths import Paths
from ajgdata.store.features import FeatureColumn, FeatureRows
from ajgdata.store.findings import is_rejected
from ajgdata.store.labels import CHANNEL_LEVELS, label_columns
from ajgdata.store.publishing.differences import RowsByRecording, counted, differences
from ajgdata.store.publishing.table import cell_texts
from ajgdata.store.session_audio import label_rows
from ajgdata.store.sessions import (
    dropped_sessions,
    list_sessions,
    read_recordings,
    read_session,
)
from ajgdata.types import WHOLE, DataError, DatasetSpec, Finding, Recording, Session, left_out

#: Attributes of a target's column that dataset.yaml defines.
_DEFINED = ("role", "units", "long_name")


@dataclass(frozen=True)
class SessionTables:
    """The tables of all sessions of a data set.

    `recordings` are the rows of recordings.csv and `labels` the rows of labels, both by
    `<session>/<recording_id>`. `unusable` are session_id and recording_id of rows that cannot be
    used; the recording_id of a session that cannot be read is `*`.
    """

    sessions: Mapping[str, Session]
    recordings: Mapping[str, Recording]
    labels: Mapping[str, Mapping[str, str]]
    unusable: Collection[tuple[str, str]]


def read_session_tables(paths: Paths, spec: DatasetSpec) -> SessionTables:
    """Return the tables of the sessions that a run of the data set would read."""
    virtual = session_names(spec.recipe)
    names = set(list_sessions(paths, spec.name)) - dropped_sessions(paths, spec.name, virtual)
    sessions = {}
    recordings = {}
    labels = {}
    unusable = set()
    for name in sorted(names):
        folder = paths.session(spec.name, name)
        try:
            session = read_session(folder)
            rows, issues = read_recordings(folder)
        except DataError:
            unusable.add((name, WHOLE))
            continue
        sessions[name] = session
        unusable.update((name, issue.recording_id) for issue in issues)
        for row, texts in zip(rows, label_rows(session, rows), strict=True):
            key = f"{name}/{row.recording_id}"
            recordings[key] = row
            labels[key] = {**texts, "session_id": name}
    return SessionTables(sessions, recordings, labels, unusable)


def check_equal(
    location: Path,
    spec: DatasetSpec,
    store: FeatureRows,
    quarantine: Collection[Finding],
    tables: SessionTables,
) -> None:
    """Raise DataError if the feature file `location` differs from the tables of the sessions.

    Recordings, labels, grasps, qualities and hashes of `store` must be those of the tables, and
    every other recording must be in `quarantine`. The message has the first difference of each
    kind, and the number of differences.
    """
    phrases = [
        *_different_recordings(store, quarantine, tables),
        *_different_labels(spec, store, tables),
    ]
    if phrases:
        problem = f"differs from the recordings of the sessions: {'; '.join(phrases)}"
        raise DataError(location, problem, f"run `ajgdata run {spec.name}`, then publish again")


def _different_recordings(
    store: FeatureRows, quarantine: Collection[Finding], tables: SessionTables
) -> list[str]:
    """Return phrases about recordings that only one side has, or that are rejected on one side."""
    used = set(store.columns["recording"].values.tolist())
    excluded = {f"{session}/{name}" for session, name in left_out(quarantine)}
    unusable = {f"{session}/{name}" for session, name in tables.unusable}
    rejected_before = {
        f"{issue.session_id}/{issue.recording_id}"
        for issue in quarantine
        if issue.code == "rejected"
    }
    rejected_now = {name for name, row in tables.labels.items() if is_rejected(row)}
    present = set(tables.labels)
    unreadable = unusable - excluded
    # Recordings of a whole session in the quarantine that can be read again are "added".
    read_again = {f"{name.partition('/')[0]}/{WHOLE}" for name in present}
    # A session that had no recordings has an issue of the whole session, and is still there.
    without_recordings = {
        f"{issue.session_id}/{WHOLE}"
        for issue in quarantine
        if issue.code == "no_recordings" and issue.session_id in tables.sessions
    }
    accounted = unusable | read_again | without_recordings
    sets = {
        "rejected": rejected_now - rejected_before,
        "no longer rejected": (rejected_before - rejected_now) & present,
        "quarantined": used & excluded,
        "added": present - used - excluded - rejected_now,
        "removed": (used - present - unreadable) | (excluded - present - accounted),
        "no longer readable": unreadable,
    }
    return [counted("recording", names, verb) for verb, names in sets.items() if names]


def _different_labels(spec: DatasetSpec, store: FeatureRows, tables: SessionTables) -> list[str]:
    """Return phrases about the labels and hashes of the recordings that both sides have."""
    used = store.columns["recording"].values.tolist()
    names = [name for name in used if name in tables.labels]
    columns = {column for row in tables.labels.values() for column in row}
    current = label_columns([tables.labels[name] for name in names], columns, spec.label_targets)
    ignored = {"recording", "flags", "sha256", CHANNEL_LEVELS}
    before = _rows(used, {n: c for n, c in store.columns.items() if n not in ignored}, names)
    after = _rows(names, {n: c for n, c in current.items() if n not in ignored}, names)
    phrases = differences(before, after)
    hashes = dict(zip(used, store.columns["sha256"].values.tolist(), strict=True))
    stated = {name: tables.recordings[name].sha256 for name in names}
    phrases += differences(
        {name: {"sha256": hashes[name]} for name in names},
        {name: {"sha256": stated[name] or hashes[name]} for name in names},
    )
    for name in sorted(set(store.columns) & set(current)):
        old = store.columns[name].attrs
        new = current[name].attrs
        changed = [key for key in _DEFINED if old.get(key) != new.get(key)]
        if changed and "target" in (old.get("role"), new.get("role")):
            phrases.append(f"definition of {name} in dataset.yaml")
    return phrases


def _rows(
    used: list[str], columns: Mapping[str, FeatureColumn], names: list[str]
) -> RowsByRecording:
    """Return the cells of the recordings `names`; `used` are the recordings of `columns`."""
    cells = {column: cell_texts(values.values) for column, values in columns.items()}
    position = {name: row for row, name in enumerate(used)}
    return {
        name: {column: texts[position[name]] for column, texts in cells.items()} for name in names
    }
