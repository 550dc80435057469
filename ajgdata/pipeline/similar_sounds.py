"""Copies of a sound within a data set, and between a data set and its test sets."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ajgdata.acquire.protocol import REFERENCE
from ajgdata.features import similarity
from ajgdata.store.features import FeatureRows
from ajgdata.store.labels import copy_finding, take_rows
from ajgdata.types import WHOLE, FeatureKind, FeatureSettings, Finding
from ajgdata.types.session import SIMULATED_SOURCES

# Codes of issues.
SIMILAR = "similar"
LEAK = "leak"
_FIX = "check whether one is a copy: give both the same grasp_id, or set quality to reject for one"
_LEAK_FIX = "remove the copies from one data set, or this data set from test_on"
#: Source of the sessions that `ajgdata record` writes.
RECORDED_HERE = "soundcard"


class Sounds(NamedTuple):
    """Sounds of n recordings of grasps, without empty-gripper references.

    - `recordings`: names `<session>/<recording_id>`
    - `grasps`: names of their grasps
    - `labels`: texts of their labels
    - `fingerprints`: (n, b), see `features.similarity`
    - `sources`: sources of their sessions

    Simulated grasps of one object differ less than recorded ones. Similar sounds of a simulation
    are therefore not copies; only equal sounds are issues.
    """

    recordings: Sequence[str]
    grasps: Sequence[str]
    labels: Sequence[tuple[str, ...]]
    fingerprints: np.ndarray
    sources: Sequence[str]

    @property
    def is_simulated(self) -> bool:
        """Return whether all sessions were simulated."""
        return bool(self.sources) and set(self.sources) <= SIMULATED_SOURCES

    @property
    def copy_groups(self) -> list[str]:
        """Return the group of each recording whose members cannot be copies of each other.

        A group is a grasp. The recordings of a session with a sound card are one group, because
        the program recorded each of them itself.
        """
        return [
            name.partition("/")[0] if source == RECORDED_HERE else grasp
            for name, grasp, source in zip(self.recordings, self.grasps, self.sources, strict=True)
        ]

    def select(self, rows: Sequence[int]) -> Sounds:
        """Return the recordings in `rows`."""
        return Sounds(
            [self.recordings[row] for row in rows],
            [self.grasps[row] for row in rows],
            [self.labels[row] for row in rows],
            self.fingerprints[np.asarray(rows, int)],
            [self.sources[row] for row in rows],
        )


def sounds_of(table: FeatureRows, targets: Sequence[str], features: FeatureKind) -> Sounds:
    """Return the sounds of a feature file with the settings `features`.

    A table without sources has the source "". Only spectra have fingerprints.
    """
    count = len(table.feature)
    labels = [table.columns[name].values for name in targets if name in table.columns]
    sources = [""] * count
    if "source" in table.columns:
        sources = [str(source) for source in table.columns["source"].values]
    sounds = Sounds(
        [str(name) for name in table.columns["recording"].values],
        [str(name) for name in table.columns["grasp_id"].values],
        [tuple(str(values[row]) for values in labels) for row in range(count)],
        stored_fingerprints(table, features),
        sources,
    )
    if REFERENCE not in table.columns:
        return sounds
    return sounds.select(np.flatnonzero(table.columns[REFERENCE].values == "").tolist())


def stored_fingerprints(table: FeatureRows, features: FeatureKind) -> np.ndarray:
    """Return the fingerprints (n, b) of the spectra of a feature file, see `features.similarity`.

    Spectra of several microphones are summed. Other features than spectra have no bands: b is 0.
    """
    if not isinstance(features, FeatureSettings):
        return np.zeros((len(table.feature), 0), np.float32)
    spectra = table.feature if table.has_bins_only else table.feature.sum(axis=1)
    return similarity.fingerprints(spectra, table.frequency_hz, features.quantity)


def without_equal_sounds(
    table: FeatureRows, targets: Sequence[str], features: FeatureKind
) -> tuple[FeatureRows, list[Finding]]:
    """Return the table without copies of a sound, and all issues (see `sound_issues`)."""
    if not isinstance(features, FeatureSettings):
        return table, [_not_searched(features.kind)]
    issues = sound_issues(sounds_of(table, targets, features))
    excluded = {f"{issue.session_id}/{issue.recording_id}" for issue in issues if issue.leaves_out}
    names = table.columns["recording"].values
    if excluded:
        table = take_rows(table, np.asarray([str(name) not in excluded for name in names], bool))
    return table, issues


def sound_issues(sounds: Sounds) -> list[Finding]:
    """Return issues of recordings of different grasps with equal or similar sounds.

    Equal sounds have the consequences of equal bytes: if their labels differ, all are errors;
    otherwise all but the first are excluded. Similar sounds are warnings. Fingerprints with too few
    bands are not compared, which is a warning for the data set.
    """
    if not _has_enough_bands(sounds):
        return [_not_compared(sounds)] if len(sounds.recordings) > 1 else []
    excluded = _equal_sounds(sounds)
    used = [row for row in range(len(sounds.recordings)) if row not in excluded]
    return [*excluded.values(), *_similar_sounds(sounds.select(used))]


def _has_enough_bands(sounds: Sounds) -> bool:
    """Return whether fingerprints have the bands that a comparison requires."""
    return sounds.fingerprints.shape[1] >= similarity.FEWEST_BANDS


def _not_searched(kind: str) -> Finding:
    """Return a note that copies of a sound are not searched in features of this kind."""
    problem = f"copies of a sound were not searched in features of the kind {kind}"
    fix = "run `ajgdata check`, which searches copies in the recordings"
    return Finding(WHOLE, WHOLE, "", "note", SIMILAR, problem, fix)


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
    issues = {}
    for rows in similarity.equal_groups(sounds.fingerprints):
        grasps = [sounds.grasps[row] for row in rows]
        if len(set(grasps)) == 1:
            continue
        differ = len({sounds.labels[row] for row in rows}) > 1
        for row in rows:
            if differ or sounds.grasps[row] != grasps[0]:
                in_other_grasp = [n for n in rows if sounds.grasps[n] != sounds.grasps[row]]
                other = sounds.recordings[in_other_grasp[0]]
                problem = f"the same sound as {other} ({len(rows)} recordings)"
                issues[row] = copy_finding(sounds.recordings[row], problem, differ=differ)
    return issues


def _similar_sounds(sounds: Sounds) -> list[Finding]:
    """Return a warning for each recording that is similar to one of another grasp."""
    if sounds.is_simulated:
        return []
    limit = similarity.tolerance(sounds.fingerprints, sounds.grasps)
    pairs = similarity.similar_pairs(sounds.fingerprints, sounds.copy_groups, limit)
    nearest: dict[int, tuple[float, int]] = {}
    counts: dict[int, int] = defaultdict(int)
    for first, second, distance in zip(
        pairs.first.tolist(), pairs.second.tolist(), pairs.distance.tolist(), strict=True
    ):
        for row, other in ((first, second), (second, first)):
            counts[row] += 1
            nearest[row] = min(nearest.get(row, (np.inf, 0)), (distance, other))
    issues = []
    for row in sorted(nearest):
        distance, other = nearest[row]
        session, _, name = sounds.recordings[row].partition("/")
        more = f" and {counts[row] - 1} more" if counts[row] > 1 else ""
        problem = (
            f"nearly the same sound as {sounds.recordings[other]}{more} of another grasp "
            f"(distance {_shown(distance, limit)})"
        )
        issues.append(Finding(session, name, "", "warning", SIMILAR, problem, _FIX))
    if not pairs.complete:
        problem = (
            f"more than {similarity.MOST_PAIRS} pairs of recordings of different grasps have "
            "nearly the same sound: not all are listed"
        )
        issues.append(Finding(WHOLE, WHOLE, "", "warning", SIMILAR, problem, _FIX))
    return issues


def _shown(distance: float, limit: float) -> str:
    """Return a distance with the tolerance that it is compared with."""
    return f"{distance:.2g}, tolerance {limit:.2g}"


def leak(own: Sounds, other: Sounds, name: str) -> str:
    """Return a line on recordings of the data set `name` that are copies of own recordings.

    The line is "" if there are none. Grasps with the same session and name are not copies:
    experiments predict them with the models of the fold that does not contain this grasp. Copies
    must also be much nearer than other grasps of their own data set (`similarity.nearer_than_own`),
    because an object with a constant sound may differ less between data sets than other objects
    between grasps.
    """
    if not _has_enough_bands(own):
        return ""  # the check of the own data set reports it
    if own.is_simulated and other.is_simulated:
        limit = 0.0
    else:
        limit = min(
            similarity.tolerance(sounds.fingerprints, sounds.grasps) for sounds in (own, other)
        )
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
    """Return the data sets that a task cannot be tested on, with the reason and the fix."""
    fix = f"{_LEAK_FIX[:1].upper()}{_LEAK_FIX[1:]}"
    return {name: f"{line}. {fix}" for name, line in _leaks(own, tests).items()}


def leak_issues(own: Sounds, tests: Mapping[str, Sounds]) -> list[Finding]:
    """Return an error for each data set of `test_on` that contains copies of own recordings."""
    lines = _leaks(own, tests).values()
    return [Finding(WHOLE, WHOLE, "", "error", LEAK, line, _LEAK_FIX) for line in lines]
