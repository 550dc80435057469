"""Differences between two tables of recordings, in words."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from ajgdata.types import RECORDING_COLUMNS, SESSION_COLUMNS

#: Text of each cell by column, of each recording by `<session>/<recording_id>`.
Rows = Mapping[str, Mapping[str, str]]

#: Columns of which a value is not a label. (An object is a label.)
_NOT_LABELS = {*RECORDING_COLUMNS, *SESSION_COLUMNS, "session_id", "flags"} - {"object"}


def differences(before: Rows, after: Rows) -> list[str]:
    """Return a phrase for each kind of difference, with the count and the first recording.

    A column that only one of the tables has is named once, whatever it contains.

    >>> differences({"s/1": {"form": "cube"}}, {"s/1": {"form": "ball"}})
    ["1 label of form, first s/1: 'cube' -> 'ball'"]
    """
    removed, added = sorted(before.keys() - after.keys()), sorted(after.keys() - before.keys())
    common = sorted(before.keys() & after.keys())
    phrases = [counted("recording", names, verb) for names, verb in _named(removed, added)]
    old_columns, new_columns = _columns(before), _columns(after)
    phrases += [
        f"column {name} {verb}"
        for names, verb in _named(
            sorted(old_columns - new_columns), sorted(new_columns - old_columns)
        )
        for name in names
    ]
    for column in sorted(old_columns & new_columns):
        changed = [name for name in common if before[name][column] != after[name][column]]
        if changed:
            first = changed[0]
            phrase = _changed(column, len(changed))
            phrase = f"{phrase}, first {first}"
            if column != "sha256":
                phrase += f": {_shown(before[first][column])} -> {_shown(after[first][column])}"
            phrases.append(phrase)
    return phrases


def _named(removed: Collection[str], added: Collection[str]) -> list[tuple[Collection[str], str]]:
    """Return the collections that are not empty, with the verb of each."""
    return [(names, verb) for names, verb in ((removed, "removed"), (added, "added")) if names]


def counted(noun: str, names: Collection[str], verb: str) -> str:
    """Return e.g. `2 recordings added, first day1/9_cube`."""
    plural = "" if len(names) == 1 else "s"
    return f"{len(names)} {noun}{plural} {verb}, first {min(names)}"


def _columns(rows: Rows) -> set[str]:
    """Return the columns of a table; all its rows have the same."""
    return set(next(iter(rows.values()), {}))


def _changed(column: str, count: int) -> str:
    """Return e.g. `3 labels of form`."""
    plural = "" if count == 1 else "s"
    if column == "sha256":
        return f"{count} WAV file{plural} with other bytes"
    return f"{count} {'value' if column in _NOT_LABELS else 'label'}{plural} of {column}"


def _shown(cell: str) -> str:
    return repr(cell) if cell else "no value"
