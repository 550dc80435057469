"""Summary of a data set for reports and dataset cards, from its feature file and quarantine."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import numpy as np

from ajgdata.paths import Paths
from ajgdata.report.navigation import link_from_report
from ajgdata.report.report_data import DatasetSummary, Spectra
from ajgdata.store.feature_array import FREQUENCY
from ajgdata.store.features import FeatureRows
from ajgdata.store.findings import read_findings
from ajgdata.store.provenance import settings_digest
from ajgdata.store.sessions import audio_path, read_recordings, read_session
from ajgdata.types import WHOLE_FILE, DatasetSpec, Recording, Segment, Session
from ajgdata.types.features import feature_settings

#: Largest number of mean spectra in one figure.
MAX_SPECTRA = 8


def summary(paths: Paths, spec: DatasetSpec, store: FeatureRows) -> DatasetSummary:
    """Return the summary of a data set and its features."""
    return DatasetSummary(
        name=spec.name,
        title=spec.title or spec.name,
        source="simulated" if store.attrs["source"] == "simulated" else "recorded",
        description=spec.description,
        n_recordings=len(store.feature),
        n_sessions=len(np.unique(store.columns["session_id"].values)),
        sample_rate_hz=spec.audio.sample_rate_hz,
        licence=spec.licence,
        citation=spec.citation,
        url=spec.url,
        features=feature_settings(store.settings["features"]),
        provenance=dict(
            commit=str(store.attrs["git_commit"]),
            config_hash=settings_digest(spec.audio, spec.features, *spec.tasks.values()),
            inputs_hash=str(store.attrs["inputs_sha256"]),
        ),
        findings=tuple(read_findings(paths.quarantine(spec.name))),
        spectra=mean_spectra(store, spec),
        samples=tuple(samples(paths, spec, store)) if paths.run else (),
    )


def rows_by_label(store: FeatureRows, spec: DatasetSpec) -> tuple[str, dict[str, np.ndarray]]:
    """Return the label column of the first task, and the rows (n,) of its classes or bins."""
    name = next((task.target for task in spec.tasks.values()), "")
    if name in spec.targets and spec.targets[name].columns:
        name = spec.targets[name].columns[0]
    if name not in store.columns:
        return name, {}
    target = spec.label_targets[name]
    values = store.columns[name].values
    if target.kind == "classification":
        classes = [label for label in np.unique(values) if label][:MAX_SPECTRA]
        return name, {str(label): values == label for label in classes}
    return name, _bins(values, target.unit)


def samples(paths: Paths, spec: DatasetSpec, store: FeatureRows) -> Iterator[tuple[str, str]]:
    """Yield label and link (from the report) of the first recording of each class or bin."""

    link = sound_links(paths, spec.name)
    for label, rows in rows_by_label(store, spec)[1].items():
        address = link(str(store.columns["recording"].values[np.flatnonzero(rows)[0]]))
        if address:
            yield label, address


def sound_links(paths: Paths, dataset: str) -> Callable[[str], str]:
    """Return a function that returns the link from the report to a recording of a data set.

    The function takes `session/recording`, and returns "" for a recording that no longer exists,
    and for a row of a table, which has no sound. It reads each session once.
    """

    @cache
    def read(session: str) -> tuple[Path, Session, dict[str, Recording]]:
        folder = paths.session(dataset, session)
        rows = {row.recording_id: row for row in read_recordings(folder)[0]}
        return folder, read_session(folder), rows

    def link(name: str) -> str:
        session, _, recording_id = name.partition("/")
        if not paths.session(dataset, session).is_dir():
            return ""
        folder, about, recordings = read(session)
        row = recordings.get(recording_id)
        if row is None or row.table_row is not None:
            return ""
        address = link_from_report(paths, audio_path(folder, about, row))
        return address + _media_fragment(row.segment)

    return link


def _media_fragment(segment: Segment) -> str:
    """Return the end of a link with which a browser plays only a segment of a file."""
    if segment == WHOLE_FILE:
        return ""
    end = "" if math.isinf(segment.end_s) else f",{segment.end_s}"
    return f"#t={segment.start_s}{end}"


def mean_spectra(store: FeatureRows, spec: DatasetSpec) -> Spectra | None:
    """Return the mean spectrum of each class or bin.

    A spectrum is the mean of a feature over its other dimensions than frequency. Return None if
    there is no target, no value, or no frequency.
    """
    name, groups = rows_by_label(store, spec)
    dimensions = [axis.name for axis in store.axes]
    if not groups or FREQUENCY not in dimensions:
        return None
    over = tuple(
        number for number, axis in enumerate(("recording", *dimensions)) if axis != FREQUENCY
    )
    means = [store.feature[rows].mean(axis=over, dtype=np.float64) for rows in groups.values()]
    return Spectra(store.frequency_hz, tuple(groups), np.array(means), name)


def _bins(values: np.ndarray, unit: str) -> dict[str, np.ndarray]:
    """Return the rows (n,) of up to four equally filled bins of `values` (n,), by their range.

    Rows with NaN or infinity are in no bin.
    """
    present = values[np.isfinite(values)]
    if not len(present):
        return {}
    edges = np.unique(np.quantile(present, np.linspace(0, 1, 5)))
    bins = np.clip(np.searchsorted(edges, values, "right") - 1, 0, max(0, len(edges) - 2))
    bins[~np.isfinite(values)] = -1
    return {
        f"{values[bins == b].min():g}–{values[bins == b].max():g} {unit}": bins == b
        for b in np.unique(bins[bins >= 0])
    }
