"""Differences between two tables of recordings, in words."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from ajgdata.types import RECORDING_COLUMNS, SESSION_COLUMNS, many

#: Text of each cell by column, of each recording by `<session>/<recording_id>`.
RowsByRecording = Mapping[str, Mapping[str, str]]

#: Columns whose values are not labels. An object is a label.
_NOT_LABELS = {*RECORDING_COLUMNS, *SESSION_COLUMNS, "session_id", "flags"} - {"object"}


def differences(before: RowsByRecording, after: RowsByRecording) -> list[str]:
    """Return a phrase for each type of difference, with the count and the first recording.

    A column that is in only one table has one phrase for the whole column.

    >>> differences({"s/1": {"form": "cube"}}, {"s/1": {"form": "ball"}})
    ["1 label of form, first s/1: 'cube' -> 'ball'"]
    """
    phrases = []
    removed = before.keys() - after.keys()
    if removed:
        phrases.append(counted("recording", removed, "removed"))
    added = after.keys() - before.keys()
    if added:
        phrases.append(counted("recording", added, "added"))
    old_columns = _columns(before)
    new_columns = _columns(after)
    phrases += [f"column {name} removed" for name in sorted(old_columns - new_columns)]
    phrases += [f"column {name} added" for name in sorted(new_columns - old_columns)]
    common = sorted(before.keys() & after.keys())
    for column in sorted(old_columns & new_columns):
        changed = [name for name in common if before[name][column] != after[name][column]]
        if changed:
            first = changed[0]
            phrase = f"{_changed(column, len(changed))}, first {first}"
            if column != "sha256":
                cells = f"{_shown(before[first][column])} -> {_shown(after[first][column])}"
                phrase = f"{phrase}: {cells}"
            phrases.append(phrase)
    return phrases


def counted(noun: str, names: Collection[str], verb: str) -> str:
    """Return e.g. `2 recordings added, first day1/9_cube`."""
    return f"{many(len(names), noun)} {verb}, first {min(names)}"


def _columns(rows: RowsByRecording) -> set[str]:
    """Return the columns of a table; all its rows have the same."""
    return set(next(iter(rows.values()), {}))


def _changed(column: str, count: int) -> str:
    """Return e.g. `3 labels of form`."""
    if column == "sha256":
        return f"{many(count, 'audio file')} with different content"
    noun = "value" if column in _NOT_LABELS else "label"
    return f"{many(count, noun)} of {column}"


def _shown(cell: str) -> str:
    """Return a cell in quotes."""
    return repr(cell) if cell else "no value"
