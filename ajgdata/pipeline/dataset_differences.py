"""`ajgdata diff`: recordings that differ between two versions of a data set."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from ajgdata.pipeline.dataset_versions import VersionRows


class ChangeKind(StrEnum):
    """The kind of a difference, in the order of the output."""

    ADDED = "added"
    REMOVED = "removed"
    RENAMED = "renamed"
    SOUND = "sound"
    RELABELLED = "relabelled"
    LABEL_ADDED = "label added"
    LABEL_REMOVED = "label removed"


class VersionDifference(NamedTuple):
    """One difference of a recording, or of a label column of all recordings.

    `recording` is its name in the second version, except if it is removed. `label` is a column of
    labels, "" if the difference is not one of labels. `old` and `new` are the names, hashes or
    labels that differ; "" is a missing label.
    """

    change: ChangeKind
    recording: str = ""
    label: str = ""
    old: str = ""
    new: str = ""


@dataclass(frozen=True)
class DatasetDifferences:
    """All differences of two versions, in the order of `ChangeKind`, and numbers of recordings."""

    n_old: int
    n_new: int
    differences: tuple[VersionDifference, ...]

    def counts(self) -> dict[ChangeKind, int]:
        """Return the number of recordings (of columns for labels added or removed) by kind."""
        seen = {(item.change, item.recording or item.label) for item in self.differences}
        found = Counter(change for change, _ in seen)
        return {change: found[change] for change in ChangeKind}


def compare_versions(old: VersionRows, new: VersionRows) -> DatasetDifferences:
    """Return the differences between two versions of a data set.

    A recording is renamed if no other recording of either version has its sound. Sounds are
    compared by their sha256, and only if both versions state it.
    """
    renamed = _renamed(old, new)
    before = {**old, **{name: old[name_before] for name, name_before in renamed.items()}}
    old_columns = {column for row in old.values() for column in row.labels}
    new_columns = {column for row in new.values() for column in row.labels}
    common = sorted(old_columns & new_columns)
    found = [
        *(
            VersionDifference(ChangeKind.ADDED, name)
            for name in sorted(new.keys() - old.keys() - renamed.keys())
        ),
        *(
            VersionDifference(ChangeKind.REMOVED, name)
            for name in sorted(old.keys() - new.keys() - set(renamed.values()))
        ),
        *(
            VersionDifference(ChangeKind.RENAMED, name, old=name_before, new=name)
            for name, name_before in sorted(renamed.items())
        ),
    ]
    for name in sorted(new.keys() & before.keys()):
        sounds = before[name].sha256, new[name].sha256
        if all(sounds) and sounds[0] != sounds[1]:
            found.append(VersionDifference(ChangeKind.SOUND, name, "", *sounds))
    for name in sorted(new.keys() & before.keys()):
        found += _relabelled(name, before[name].labels, new[name].labels, common)
    if old and new:
        found += [
            VersionDifference(ChangeKind.LABEL_ADDED, label=column)
            for column in sorted(new_columns - old_columns)
        ]
        found += [
            VersionDifference(ChangeKind.LABEL_REMOVED, label=column)
            for column in sorted(old_columns - new_columns)
        ]
    return DatasetDifferences(len(old), len(new), tuple(found))


def _renamed(old: VersionRows, new: VersionRows) -> dict[str, str]:
    """Return the old names of renamed recordings, by the new name."""
    old_names = _names_by_sound(old)
    new_names = _names_by_sound(new)
    return {
        new_name: old_names[sound]
        for sound, new_name in new_names.items()
        if sound in old_names and new_name not in old and old_names[sound] not in new
    }


def _names_by_sound(rows: VersionRows) -> dict[str, str]:
    """Return the names of the recordings whose sha256 no other recording has, by sha256."""
    counts = Counter(row.sha256 for row in rows.values())
    return {
        row.sha256: name for name, row in rows.items() if row.sha256 and counts[row.sha256] == 1
    }


def _relabelled(
    name: str, old: Mapping[str, str], new: Mapping[str, str], columns: list[str]
) -> Iterator[VersionDifference]:
    """Yield the labels that differ, for the `columns` that both versions have."""
    for column in columns:
        before = old.get(column, "")
        after = new.get(column, "")
        if before != after:
            yield VersionDifference(ChangeKind.RELABELLED, name, column, before, after)
