"""Copies of a sound in a data set, and between a data set and the data sets it is tested on."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ajgdata.acquire.protocol import REFERENCE
from ajgdata.experiments.requests import requested_experiments
from ajgdata.features import similarity
from ajgdata.features.spectrum import frequencies_hz, settings_text, spectrum
from ajgdata.paths import Paths
from ajgdata.pipeline.recordings import examine
from ajgdata.store.features import FeatureRows, read_store
from ajgdata.store.findings import is_rejected
from ajgdata.store.labels import comparable_labels, copy_finding, take_rows
from ajgdata.store.session_audio import check_session
from ajgdata.store.sessions import list_sessions, read_dataset, read_recordings
from ajgdata.types import WHOLE, DataError, DatasetSpec, Finding, Target
from ajgdata.types.session import SIMULATED_SOURCES

SIMILAR, LEAK = "similar", "leak"
_FIX = "check whether one is a copy: give both the same grasp_id, or set quality to reject for one"
_LEAK_FIX = "remove the copies from one data set, or this data set from test_on"
#: Source of the sessions that `ajgdata record` writes.
RECORDED_HERE = "soundcard"


class Sounds(NamedTuple):
    """Recordings of grasps by name `<session>/<recording_id>`, with their grasps, the texts of
    their labels, fingerprints (n, b), and the sources of their sessions.

    Simulated grasps of one object differ less than real ones, so similar sounds of a simulation
    are not copies; only equal sounds are issues.
    """

    recordings: Sequence[str]
    grasps: Sequence[str]
    labels: Sequence[tuple[str, ...]]
    fingerprints: np.ndarray
    sources: Sequence[str]

    @property
    def is_simulated(self) -> bool:
        """True if all sessions were simulated."""
        return bool(self.sources) and set(self.sources) <= SIMULATED_SOURCES

    @property
    def takes(self) -> list[str]:
        """Groups of recordings that cannot be copies of each other: those of a grasp and, because
        the program recorded each of them itself, those of a session with a sound card."""
        return [
            name.partition("/")[0] if source == RECORDED_HERE else grasp
            for name, grasp, source in zip(self.recordings, self.grasps, self.sources, strict=True)
        ]

    def where(self, rows: Sequence[int]) -> Sounds:
        """Return the recordings that `rows` names."""
        return Sounds(
            [self.recordings[row] for row in rows],
            [self.grasps[row] for row in rows],
            [self.labels[row] for row in rows],
            self.fingerprints[np.asarray(rows, int)],
            [self.sources[row] for row in rows],
        )


def sounds_of(table: FeatureRows, targets: Sequence[str], quantity: str) -> Sounds:
    """Return the recordings of a feature file, without empty-gripper references."""
    columns = [table.columns[name].values for name in targets if name in table.columns]
    count = len(table.feature)
    sounds = Sounds(
        [str(name) for name in table.columns["recording"].values],
        [str(name) for name in table.columns["grasp_id"].values],
        [tuple(str(values[row]) for values in columns) for row in range(count)],
        similarity.fingerprints(table.feature, table.frequency_hz, quantity),
        _sources(table),
    )
    return sounds.where(_grasped(table))


def _sources(table: FeatureRows) -> list[str]:
    """Return the source of each recording's session; "" for tables without this column."""
    if "source" not in table.columns:
        return [""] * len(table.feature)
    return [str(source) for source in table.columns["source"].values]


def _grasped(table: FeatureRows) -> list[int]:
    """Return the rows that are not empty-gripper references."""
    if REFERENCE not in table.columns:
        return list(range(len(table.feature)))
    return np.flatnonzero(table.columns[REFERENCE].values == "").tolist()


def without_equal_sounds(
    table: FeatureRows, targets: Sequence[str], quantity: str
) -> tuple[FeatureRows, list[Finding]]:
    """Return the table without copies of a sound (see `sound_issues`), and all issues."""
    issues = sound_issues(sounds_of(table, targets, quantity))
    excluded = {f"{issue.session_id}/{issue.recording_id}" for issue in issues if issue.leaves_out}
    names = table.columns["recording"].values
    keep = np.asarray([str(name) not in excluded for name in names], bool)
    return (take_rows(table, keep) if excluded else table), issues


def sound_issues(sounds: Sounds) -> list[Finding]:
    """Return issues of recordings of different grasps with equal or similar sounds.

    Equal sounds have the consequences of equal bytes: with different labels all are errors,
    otherwise all but the first are excluded. Similar sounds are warnings. Fingerprints with too few
    bands are not compared, which is a warning for the data set.
    """
    if not _has_enough_bands(sounds):
        return [_not_compared(sounds)] if len(sounds.recordings) > 1 else []
    excluded = _equal_sounds(sounds)
    used = [row for row in range(len(sounds.recordings)) if row not in excluded]
    return [*excluded.values(), *_similar_sounds(sounds.where(used))]


def _has_enough_bands(sounds: Sounds) -> bool:
    """Return whether fingerprints have the bands that a comparison requires."""
    return sounds.fingerprints.shape[1] >= similarity.FEWEST_BANDS


def _not_compared(sounds: Sounds) -> Finding:
    """Return a warning that the band of the features is too narrow."""
    bands = sounds.fingerprints.shape[1]
    problem = (
        f"the features have {bands} bands above {similarity.COMPARED_BAND_HZ[0]:g} Hz, so copies"
        f" of a sound were not searched, which requires {similarity.FEWEST_BANDS}"
    )
    fix = "increase window or widen band_hz of the features in dataset.yaml"
    return Finding(WHOLE, WHOLE, "", "warning", SIMILAR, problem, fix)


def _equal_sounds(sounds: Sounds) -> dict[int, Finding]:
    """Return issues, by row, of recordings that cannot be used because their sound is a copy."""
    findings = {}
    for rows in similarity.equal_groups(sounds.fingerprints):
        grasps = [sounds.grasps[row] for row in rows]
        differ = len({sounds.labels[row] for row in rows}) > 1
        if len(set(grasps)) == 1:
            continue
        for row in rows:
            if differ or sounds.grasps[row] != grasps[0]:
                copied = [other for other in rows if sounds.grasps[other] != sounds.grasps[row]]
                other = sounds.recordings[copied[0]]
                problem = f"the same sound as {other} ({len(rows)} recordings)"
                findings[row] = copy_finding(sounds.recordings[row], problem, differ=differ)
    return findings


def _similar_sounds(sounds: Sounds) -> list[Finding]:
    """Return a warning for each recording that is similar to one of another grasp."""
    if sounds.is_simulated:
        return []
    limit = similarity.tolerance(sounds.fingerprints, sounds.grasps)
    pairs = similarity.similar_pairs(sounds.fingerprints, sounds.takes, limit)
    nearest: dict[int, tuple[float, int]] = {}
    counts: dict[int, int] = defaultdict(int)
    for first, second, distance in zip(
        pairs.first.tolist(), pairs.second.tolist(), pairs.distance.tolist(), strict=True
    ):
        for row, other in ((first, second), (second, first)):
            counts[row] += 1
            nearest[row] = min(nearest.get(row, (np.inf, 0)), (distance, other))
    findings = []
    for row in sorted(nearest):
        distance, other = nearest[row]
        session, _, name = sounds.recordings[row].partition("/")
        further = f" and {counts[row] - 1} more" if counts[row] > 1 else ""
        problem = (
            f"nearly the same sound as {sounds.recordings[other]}{further} of another grasp "
            f"(distance {_shown(distance, limit)})"
        )
        findings.append(Finding(session, name, "", "warning", SIMILAR, problem, _FIX))
    if not pairs.complete:
        problem = (
            f"more than {similarity.MOST_PAIRS} pairs of recordings of different grasps have "
            "nearly the same sound: not all are listed"
        )
        findings.append(Finding(WHOLE, WHOLE, "", "warning", SIMILAR, problem, _FIX))
    return findings


def _shown(distance: float, limit: float) -> str:
    """Return a distance with the tolerance that it is compared with."""
    return f"{distance:.2g}, tolerance {limit:.2g}"


def leak(own: Sounds, other: Sounds, name: str) -> str:
    """Return a line on recordings of the data set `name` that are copies of own recordings.

    "" if there are none. Grasps with the same session and name are no copies: experiments predict
    them with the models of the fold that does not contain this grasp. Copies must also be much
    nearer than other grasps of their own data set (`similarity.nearer_than_own`), because an object
    with a constant sound may differ less between data sets than other objects between grasps.
    """
    if not _has_enough_bands(own):
        return ""  # the check of the own data set reports it
    limits = [similarity.tolerance(sounds.fingerprints, sounds.grasps) for sounds in (own, other)]
    limit = 0.0 if own.is_simulated and other.is_simulated else min(limits)
    near = similarity.similar_between(
        own.fingerprints, other.fingerprints, own.grasps, other.grasps, limit
    )
    pairs = similarity.nearer_than_own(
        near, own.fingerprints, other.fingerprints, own.grasps, other.grasps
    )
    if not len(pairs.first):
        return ""
    least = int(np.argmin(pairs.distance))
    copied = len(np.unique(pairs.second))
    at_least = "" if pairs.complete else "at least "
    example = (
        f"{other.recordings[int(pairs.second[least])]} and "
        f"{own.recordings[int(pairs.first[least])]} of the training data"
    )
    return (
        f"{at_least}{copied} of {len(other.recordings)} recordings of {name} have the sound of a "
        f"training recording, for example {example} "
        f"(distance {_shown(float(pairs.distance[least]), limit)})"
    )


def _leaks(own: Sounds, tests: Mapping[str, Sounds]) -> dict[str, str]:
    """Return a line for each data set that contains copies of own recordings, by name."""
    lines = {name: leak(own, sounds, name) for name, sounds in tests.items()}
    return {name: line for name, line in lines.items() if line}


def leak_refusals(own: Sounds, tests: Mapping[str, Sounds]) -> dict[str, str]:
    """Return why a task cannot be tested on other data sets, with the fix, by name."""
    fix = f"{_LEAK_FIX[:1].upper()}{_LEAK_FIX[1:]}"
    return {name: f"{line}. {fix}" for name, line in _leaks(own, tests).items()}


def leak_issues(own: Sounds, tests: Mapping[str, Sounds]) -> list[Finding]:
    """Return an error for each data set of `test_on` that contains copies of own recordings."""
    lines = _leaks(own, tests).values()
    return [Finding(WHOLE, WHOLE, "", "error", LEAK, line, _LEAK_FIX) for line in lines]


class Fingerprints:
    """Fingerprints of files by the sha256 of their bytes, for one choice of settings."""

    def __init__(self, paths: Paths, spec: DatasetSpec) -> None:
        self._audio, self._features = spec.audio, spec.features
        self._frequency_hz = frequencies_hz(spec.audio.sample_rate_hz, spec.features)
        self._spectra: dict[str, np.ndarray] = {}
        self.known = _stored(paths.features(spec.name), spec)

    def add(self, sha256: str, samples: np.ndarray | None) -> None:
        """Compute the spectrum of samples (n,), unless it is known or they have none."""
        if samples is None or sha256 in self.known:
            return
        try:
            values = spectrum(samples, self._audio.sample_rate_hz, self._features)
        except ValueError:  # the feature job reports it
            return
        self._spectra[sha256] = values

    def finish(self) -> None:
        """Replace the spectra since the last call by fingerprints, which are smaller."""
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

        `recordings` are name `<session>/<recording_id>`, sha256 and row of labels.
        """
        used = [
            (name, digest, row)
            for name, digest, row in recordings
            if digest in self.known and not row.get(REFERENCE)
        ]
        bands = len(next(iter(self.known.values()), np.zeros(0)))
        prints = np.asarray([self.known[digest] for _, digest, _ in used], np.float32)
        return Sounds(
            [name for name, _, _ in used],
            [f"{name.partition('/')[0]}/{row['grasp_id']}" for name, _, row in used],
            [comparable_labels(row, targets) for _, _, row in used],
            prints.reshape(len(used), bands),
            [row["source"] for _, _, row in used],
        )


def _stored(path: Path, spec: DatasetSpec) -> dict[str, np.ndarray]:
    """Return the fingerprints of a feature file with the settings of a data set, by sha256."""
    if not path.is_file():
        return {}
    try:
        table = read_store(path)
    except DataError:
        return {}
    if table.attrs.get("settings") != settings_text(spec.audio, spec.features):
        return {}
    digests = [str(digest) for digest in table.columns["sha256"].values]
    prints = similarity.fingerprints(table.feature, table.frequency_hz, spec.features.quantity)
    return dict(zip(digests, prints, strict=True))


def test_sets(spec: DatasetSpec) -> list[str]:
    """Return the data sets that the tasks of a data set are tested on, without itself.

    A placebo is no test set.
    """
    requests = (request for task in spec.tasks for request in requested_experiments(spec, task))
    names = dict.fromkeys(name for request in requests for name in request.test_sets)
    return [name for name in names if name != spec.name]


def dataset_sounds(paths: Paths, dataset: str) -> Sounds | None:
    """Return the recordings of another data set; None if it has none that can be used.

    Its files are read only if its feature file does not contain them.
    """
    try:
        spec = read_dataset(paths, dataset)
        folders = [paths.session(dataset, name) for name in list_sessions(paths, dataset)]
    except DataError:
        return None  # the check of this data set reports it
    prints = Fingerprints(paths, spec)
    recordings: list[tuple[str, str, dict[str, str]]] = []
    for folder in folders:
        session = check_session(folder, _trusted(folder, prints))
        labels = {row["recording_id"]: row for row in session.labels if not is_rejected(row)}
        for file in session.files:
            if file.recording_id not in labels:
                continue
            if file.sha256 not in prints.known:
                samples = examine(file.path, spec.audio, spec.features.window).samples
                prints.add(file.sha256, samples)
            name = f"{session.session_id}/{file.recording_id}"
            recordings.append((name, file.sha256, labels[file.recording_id]))
        prints.finish()
    sounds = prints.sounds(recordings, {})
    return sounds if sounds.recordings else None


def _trusted(folder: Path, prints: Fingerprints) -> dict[str, str]:
    """Return the sha256 of recordings with a known fingerprint, by recording_id."""
    try:
        recordings = read_recordings(folder)[0]
    except DataError:
        return {}
    return {row.recording_id: row.sha256 for row in recordings if row.sha256 in prints.known}


def checked_sounds(paths: Paths, spec: DatasetSpec, sounds: Sounds) -> list[Finding]:
    """Return all issues of equal and similar sounds of a data set, and of the data sets that its
    tasks are tested on."""
    if not sounds.recordings:
        return []
    tests = {name: dataset_sounds(paths, name) for name in test_sets(spec)}
    comparable = {
        name: other
        for name, other in tests.items()
        if other and other.fingerprints.shape[1] == sounds.fingerprints.shape[1]
    }
    return [*sound_issues(sounds), *leak_issues(sounds, comparable)]
