"""A data set's store, findings and first session -> what a report or a card says of it."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.paths import Paths
from ajgdata.report.report_data import DatasetSummary, Provenance, Spectra
from ajgdata.store.features import Shard, read_labels, spectra_blocks
from ajgdata.store.findings import read_findings
from ajgdata.store.provenance import settings_digest
from ajgdata.store.sessions import read_session
from ajgdata.types import DataError, DatasetSpec, FeatureSettings

#: Largest number of mean spectra in one figure.
MAX_SPECTRA = 8


def summary(paths: Paths, spec: DatasetSpec, features_file: Path) -> DatasetSummary:
    """Return what the report and the dataset card state about a data set and its feature file."""
    store = read_labels(features_file)
    settings = json.loads(str(store.attrs["settings"]))
    features = FeatureSettings(**settings["features"])
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
        features=features,
        provenance=Provenance(
            version=str(store.attrs["ajgdata_version"]),
            commit=str(store.attrs["git_commit"]),
            config_hash=settings_digest(spec.audio, spec.features, *spec.tasks.values()),
            inputs_hash=str(store.attrs["inputs_sha256"]),
        ),
        findings=tuple(read_findings(paths.quarantine(spec.name))),
        spectra=mean_spectra(store, spec, spectra_blocks(features_file)),
        facts=_facts(paths, spec.name, store),
    )


def _facts(paths: Paths, dataset: str, store: Shard) -> Mapping[str, Any]:
    """Return what a session says of its source, flattened: `numerics dx_mm`, for instance."""
    sessions = sorted(set(store.columns["session_id"].values.tolist()))
    try:
        session = read_session(paths.session(dataset, sessions[0]))
    except (DataError, IndexError):  # no session is left, or it was spoilt since
        return {}
    facts: dict[str, Any] = {"gripper": session.gripper, "medium": session.medium}
    facts |= {"device": session.device, "written by": session.software}
    for part, content in session.scene.items():
        items = content.items() if isinstance(content, dict) else [("", content)]
        facts |= {f"{part} {key}".strip(): value for key, value in items}
    return {key: value for key, value in facts.items() if value not in ("unknown", "")}


def mean_spectra(store: Shard, spec: DatasetSpec, blocks: Iterable[np.ndarray]) -> Spectra | None:
    """Return the mean spectrum of each class, or of equally filled bins, of the first target.

    The spectra of the store are those of `blocks`, each (m, f), one after another.
    """
    name = next((task.target for task in spec.tasks.values()), "")
    if name not in store.columns:
        return None
    target, values = spec.targets[name], store.columns[name].values
    if target.kind == "classification":
        classes = [c for c in np.unique(values) if c][:MAX_SPECTRA]
        parts = [(str(c), values == c) for c in classes]
    else:
        present = values[np.isfinite(values)]
        if not len(present):
            return None
        edges = np.unique(np.quantile(present, np.linspace(0, 1, 5)))
        bins = np.clip(np.searchsorted(edges, values, "right") - 1, 0, max(0, len(edges) - 2))
        bins[~np.isfinite(values)] = -1
        parts = [
            (f"{values[bins == b].min():g}–{values[bins == b].max():g} {target.unit}", bins == b)
            for b in np.unique(bins[bins >= 0])
        ]
    if not parts:
        return None
    total, done = np.zeros((len(parts), len(store.frequency_hz))), 0
    for block in blocks:
        for number, (_, rows) in enumerate(parts):
            some = block[rows[done : done + len(block)]]
            total[number] += some.sum(axis=0, dtype=np.float64)
        done += len(block)
    mean = total / np.array([[np.count_nonzero(rows)] for _, rows in parts])
    return Spectra(store.frequency_hz, tuple(label for label, _ in parts), mean, name)
