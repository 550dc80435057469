"""Fingerprints of the files of a data set, and the check of its sounds for copies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ajgdata.acquire.protocol import REFERENCE
from ajgdata.experiments.requests import requested_experiments
from ajgdata.features import similarity
from ajgdata.features.spectrum import frequencies_hz, settings_text, spectrum
from ajgdata.paths import Paths
from ajgdata.pipeline.recordings import examine
from ajgdata.pipeline.similar_sounds import (
    Sounds,
    leak_issues,
    sound_issues,
    stored_fingerprints,
)
from ajgdata.store.features import read_store
from ajgdata.store.findings import is_rejected
from ajgdata.store.labels import comparable_labels, sound_ids
from ajgdata.store.session_audio import check_session
from ajgdata.store.sessions import list_sessions, read_dataset, read_recordings
from ajgdata.types import DataError, DatasetSpec, FeatureSettings, Finding, Target


class Fingerprints:
    """Fingerprints of recordings by `Segment.sound_id`, for one choice of settings.

    They are computed from spectra: those of the data set, or else with the default settings.
    """

    def __init__(self, paths: Paths, spec: DatasetSpec) -> None:
        """Start with the fingerprints of the feature file of a data set."""
        self._audio = spec.audio
        self._features = (
            spec.features if isinstance(spec.features, FeatureSettings) else FeatureSettings()
        )
        self._frequency_hz = frequencies_hz(spec.audio.sample_rate_hz, self._features)
        self._spectra: dict[str, np.ndarray] = {}
        self.known = _stored_fingerprints(paths.features(spec.name), spec)

    def add(self, sound_id: str, samples: np.ndarray | None) -> None:
        """Compute the spectrum of samples (n,) or (channels, n), unless it is known or they have
        none. Spectra of several microphones are summed."""
        if samples is None or sound_id in self.known:
            return
        try:
            rows = [
                spectrum(row, self._audio.sample_rate_hz, self._features)
                for row in np.atleast_2d(samples)
            ]
        except ValueError:  # the feature job reports it
            return
        self._spectra[sound_id] = np.sum(rows, axis=0)

    def finish(self) -> None:
        """Replace the spectra since the last call by fingerprints, which need less memory."""
        if self._spectra:
            prints = similarity.fingerprints(
                np.asarray([*self._spectra.values()]), self._frequency_hz, self._features.quantity
            )
            self.known.update(zip(self._spectra, prints, strict=True))
            self._spectra.clear()

    def sounds(
        self,
        recordings: Sequence[tuple[str, str, Mapping[str, str]]],
        targets: Mapping[str, Target],
    ) -> Sounds:
        """Return the recordings that have a fingerprint and are not references.

        `recordings` are name `<session>/<recording_id>`, sound_id and row of labels.
        """
        used = [
            (name, sound_id, row)
            for name, sound_id, row in recordings
            if sound_id in self.known and not row.get(REFERENCE)
        ]
        bands = len(next(iter(self.known.values()), np.zeros(0)))
        prints = np.asarray([self.known[sound_id] for _, sound_id, _ in used], np.float32)
        return Sounds(
            [name for name, _, _ in used],
            [f"{name.partition('/')[0]}/{row['grasp_id']}" for name, _, row in used],
            [comparable_labels(row, targets) for _, _, row in used],
            prints.reshape(len(used), bands),
            [row["source"] for _, _, row in used],
        )


def _stored_fingerprints(path: Path, spec: DatasetSpec) -> dict[str, np.ndarray]:
    """Return the fingerprints of a feature file with the settings of a data set, by sound_id.

    There are none for other features than spectra.
    """
    if not (path.is_file() and isinstance(spec.features, FeatureSettings)):
        return {}
    try:
        table = read_store(path)
    except DataError:
        return {}
    if table.attrs.get("settings") != settings_text(spec.audio, spec.features):
        return {}
    prints = stored_fingerprints(table, spec.features)
    return dict(zip(sound_ids(table), prints, strict=True))


def checked_sounds(paths: Paths, spec: DatasetSpec, sounds: Sounds) -> list[Finding]:
    """Return all issues of equal and similar sounds of a data set, and of its test sets."""
    if not sounds.recordings:
        return []
    tests = {name: dataset_sounds(paths, name) for name in test_sets(spec)}
    comparable = {
        name: other
        for name, other in tests.items()
        if other and other.fingerprints.shape[1] == sounds.fingerprints.shape[1]
    }
    return [*sound_issues(sounds), *leak_issues(sounds, comparable)]


def test_sets(spec: DatasetSpec) -> list[str]:
    """Return the other data sets that the tasks of a data set are tested on.

    A placebo is not a test set.
    """
    names: dict[str, None] = {}
    for task in spec.tasks:
        for request in requested_experiments(spec, task):
            names.update(dict.fromkeys(request.test_sets))
    return [name for name in names if name != spec.name]


def dataset_sounds(paths: Paths, dataset: str) -> Sounds | None:
    """Return the sounds of another data set; None if it has no usable recording, or no waveforms.

    Its audio files are read only if its feature file does not contain them.
    """
    try:
        spec = read_dataset(paths, dataset)
        folders = [paths.session(dataset, name) for name in list_sessions(paths, dataset)]
    except DataError:
        return None  # the check of this data set reports it
    if not spec.features.needs_waveform:
        return None
    prints = Fingerprints(paths, spec)
    least_samples = spec.features.least_samples(spec.audio.sample_rate_hz)
    recordings: list[tuple[str, str, dict[str, str]]] = []
    for folder in folders:
        session = check_session(folder, _known_hashes(folder, prints))
        labels = {row["recording_id"]: row for row in session.labels if not is_rejected(row)}
        for file in session.files:
            if file.recording_id not in labels:
                continue
            if file.sound_id not in prints.known:
                result = examine(file.path, spec.audio, least_samples, segment=file.segment)
                prints.add(file.sound_id, result.samples)
            name = f"{session.session_id}/{file.recording_id}"
            recordings.append((name, file.sound_id, labels[file.recording_id]))
        prints.finish()
    sounds = prints.sounds(recordings, {})
    return sounds if sounds.recordings else None


def _known_hashes(folder: Path, prints: Fingerprints) -> dict[str, str]:
    """Return the sha256 of recordings with a known fingerprint, by recording_id."""
    try:
        recordings = read_recordings(folder)[0]
    except DataError:
        return {}
    return {row.recording_id: row.sha256 for row in recordings if row.sound_id in prints.known}
