"""metadata.csv: the table of the recordings of a published data set, from its feature file."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ajgdata.paths import Tree
from ajgdata.store.features import FeatureRows
from ajgdata.store.files import csv_bytes
from ajgdata.store.labels import MEANINGS
from ajgdata.store.publishing.columns import RENAME, unpublishable
from ajgdata.types import DataError

FILE_NAME = "file_name"
#: First columns, in this order. Targets follow, then all other columns by name.
LEADING_COLUMNS = ("recording", "session_id", "placement_id", "grasp_id", "sample", "object")
TRAILING_COLUMNS = ("flags", "sha256")
#: Meanings of the columns that are not targets.
MEANING = {
    **MEANINGS,
    FILE_NAME: "recording, relative to this table",
    "flags": "codes of the issues of the recording, with commas between them",
    "setup_sha256": "digest of the scene and of the settings it was simulated with",
    "sha256": "SHA-256 of the file",
}
UNDECLARED = "label from recordings.csv; dataset.yaml does not describe it"
_DATA_TYPES: dict[str, Literal["string", "integer", "number"]] = {
    "U": "string",
    "i": "integer",
    "f": "number",
}


@dataclass(frozen=True)
class PublishedColumn:
    """A column of metadata.csv."""

    name: str
    data_type: Literal["string", "integer", "number"]
    unit: str = ""
    description: str = ""
    is_target: bool = False


@dataclass(frozen=True)
class PublishedTable:
    """metadata.csv: a missing value is an empty cell."""

    columns: tuple[PublishedColumn, ...]
    rows: tuple[Mapping[str, str], ...]

    def encoded(self) -> bytes:
        """Return the bytes of metadata.csv."""
        return csv_bytes([column.name for column in self.columns], self.rows)


def table_of(
    store: FeatureRows, suffixes: Sequence[str] | None, location: object
) -> PublishedTable:
    """Return the table of a feature file; `suffixes` (n,) are those of the recordings, with a dot.

    Without suffixes, the recordings have no files, and the table has no column for them.
    Raises DataError, with all names, for columns to which readers give another meaning.
    """
    reasons = unpublishable(store.columns)
    if reasons:
        listed = "; ".join(f"{name!r} ({reason})" for name, reason in reasons.items())
        problem = f"labels with these names cannot be published: {listed}"
        raise DataError(location, problem, RENAME)
    targets = [name for name in sorted(store.columns) if _is_target(store, name)]
    labels = sorted(set(store.columns) - {*LEADING_COLUMNS, *targets, *TRAILING_COLUMNS})
    order = dict.fromkeys((*LEADING_COLUMNS, *targets, *labels, *TRAILING_COLUMNS))
    names = [name for name in order if name in store.columns]
    cells = {name: cell_texts(store.columns[name].values) for name in names}
    hashes = cells["sha256"]
    columns = tuple(_column(name, store) for name in names)
    if suffixes is None:
        count = len(hashes)
        plain = tuple({name: cells[name][row] for name in names} for row in range(count))
        return PublishedTable(columns, plain)
    rows = [
        {FILE_NAME: file_name(recording, hashes[row], suffixes[row])}
        | {name: cells[name][row] for name in names}
        for row, recording in enumerate(cells["recording"])
    ]
    first = PublishedColumn(FILE_NAME, "string", description=MEANING[FILE_NAME])
    return PublishedTable((first, *columns), tuple(rows))


def _is_target(store: FeatureRows, name: str) -> bool:
    """Return True if a column of a feature file is a target."""
    return store.columns[name].attrs.get("role") == "target"


def _column(name: str, store: FeatureRows) -> PublishedColumn:
    """Return the description of a column."""
    column = store.columns[name]
    is_target = _is_target(store, name)
    if is_target:
        meaning = column.attrs.get("long_name", MEANING.get(name, ""))
    else:
        meaning = MEANING.get(name) or column.attrs.get("long_name", UNDECLARED)
    unit = column.attrs.get("units", "").removeprefix("1")
    return PublishedColumn(name, _DATA_TYPES[column.values.dtype.kind], unit, meaning, is_target)


def cell_texts(values: np.ndarray) -> list[str]:
    """Return the cells (n,) of a column (n,).

    A missing value is empty, and a number has the shortest form that gives the same number.
    """
    if values.dtype.kind == "f":
        return ["" if math.isnan(value) else repr(value) for value in values.tolist()]
    return [str(value) for value in values.tolist()]


def file_name(recording: str, sha256: str, suffix: str) -> str:
    """Return the published file of a recording `<session>/<recording_id>`.

    The name has letters, digits, `.`, `_` and `-`. If the recording_id has other characters, the
    beginning of the hash makes the name unique.
    """
    session, _, identity = recording.partition("/")
    if re.fullmatch(r"[A-Za-z0-9_-][A-Za-z0-9._-]{0,99}", identity):
        return Tree.audio(session, f"{identity}{suffix}")
    plain = re.sub(r"[^A-Za-z0-9._-]+", "_", identity).strip("._-")[:90]
    return Tree.audio(session, f"{plain}-{sha256[:8]}{suffix}")
