"""Rows of a feature store <-> metadata.csv, the table that every view of a data set shares."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ajgdata.paths import Tree
from ajgdata.store.features import Shard
from ajgdata.store.files import csv_bytes, numbered_rows
from ajgdata.store.labels import MEANINGS
from ajgdata.types import RECORDING_COLUMNS, SESSION_COLUMNS, STORE_NAMES, DataError, Recording

FILE_NAME = "file_name"
#: Columns that lead, in this order; targets follow, then the others by name.
FIRST = ("recording", "session_id", "grasp_id", "sample", "object")
LAST = ("flags", "sha256")
MEANING = MEANINGS | {
    FILE_NAME: "recording, relative to this table",
    "flags": "codes of the issues of the recording, with commas between them",
    "delay_samples": "delay that was taken out before the feature was computed",
    "setup_sha256": "digest of the scene and of the settings it was simulated with",
    "sha256": "SHA-256 of the file",
}
UNDECLARED = "as whoever recorded it wrote it down: dataset.yaml says nothing of it"
_LONGEST_NAME = 100
_AUDIO_COLUMNS = ("file_name", "file_names")


@dataclass(frozen=True)
class PublishedColumn:
    """A column of metadata.csv."""

    name: str
    kind: Literal["string", "integer", "number"]
    unit: str = ""
    description: str = ""
    is_target: bool = False


@dataclass(frozen=True)
class Table:
    """metadata.csv: a missing value is an empty cell."""

    columns: tuple[PublishedColumn, ...]
    rows: tuple[Mapping[str, str], ...]

    @property
    def names(self) -> list[str]:
        """Names of the columns."""
        return [column.name for column in self.columns]

    def encoded(self) -> bytes:
        """Return the bytes of metadata.csv."""
        return csv_bytes(self.names, self.rows)


def table_of(store: Shard, suffixes: Sequence[str], where: object) -> Table:
    """Return the table of a store; `suffixes` (with the dot) are those of the recordings' files.

    Raises DataError for a column that Hugging Face would take for audio.
    """
    if taken := [n for n in store.columns if n == "audio" or n.endswith(_AUDIO_COLUMNS)]:
        problem = f"a label is named {min(taken)!r}, which Hugging Face takes for the audio"
        raise DataError(where, problem, "rename it in recordings.csv and dataset.yaml")
    names = [n for n in FIRST if n in store.columns]
    targets = [n for n, c in sorted(store.columns.items()) if c.attrs.get("role") == "target"]
    names += [n for n in targets if n not in names]
    names += sorted(set(store.columns) - {*names, *LAST}) + [n for n in LAST if n in store.columns]
    columns = [PublishedColumn(FILE_NAME, "string", description=MEANING[FILE_NAME])]
    columns += [_column(name, store) for name in names]
    cells = {name: _texts(store.columns[name].values) for name in names}
    files = file_names(cells["recording"], suffixes)
    rows = [
        {FILE_NAME: file} | {name: cells[name][row] for name in names}
        for row, file in enumerate(files)
    ]
    return Table(tuple(columns), tuple(rows))


def _column(name: str, store: Shard) -> PublishedColumn:
    column = store.columns[name]
    kinds = {"U": "string", "i": "integer", "f": "number"}
    is_target = column.attrs.get("role") == "target"
    meaning = MEANING.get(name, "" if is_target else UNDECLARED)
    if is_target:
        meaning = column.attrs.get("long_name", meaning)
    return PublishedColumn(
        name,
        kinds[column.values.dtype.kind],  # type: ignore[arg-type]  # the values above
        column.attrs.get("units", "").removeprefix("1"),
        meaning,
        is_target,
    )


def _texts(values: np.ndarray) -> list[str]:
    """Return cells of a column; numbers in the shortest form that gives the same number again."""
    if values.dtype.kind == "f":
        return ["" if math.isnan(value) else repr(value) for value in values.tolist()]
    return [str(value) for value in values.tolist()]


def file_names(recordings: Sequence[str], suffixes: Sequence[str]) -> list[str]:
    """Return names in the tree of recordings `<session>/<recording_id>`, fit for every file system
    and web address: letters, digits, `.`, `_` and `-`; what would then be equal is numbered."""
    taken: set[str] = set()
    names = []
    for recording, suffix in zip(recordings, suffixes, strict=True):
        session, _, identity = recording.partition("/")
        stem = (
            re.sub(r"[^A-Za-z0-9._-]+", "_", identity).strip("._-")[:_LONGEST_NAME] or "recording"
        )
        name, number = Tree.audio(session, f"{stem}{suffix}"), 1
        while name.lower() in taken:
            number += 1
            name = Tree.audio(session, f"{stem}-{number}{suffix}")
        taken.add(name.lower())
        names.append(name)
    return names


def read_table(tree: Tree) -> tuple[list[str], list[tuple[int, dict[str, str]]]]:
    """Return the header of metadata.csv, and its rows with their lines. Raises DataError."""
    needed = (FILE_NAME, "recording", "session_id", "grasp_id", "sample", "sha256")
    return numbered_rows(tree / tree.METADATA, required=needed)


def recordings_of(rows: Sequence[Mapping[str, str]]) -> Iterator[tuple[str, Recording]]:
    """Yield the session and row of recordings.csv for each row of metadata.csv: the way back.

    Raises ValueError (pydantic's included) for a row that no recording can be made of.
    """
    standard = {FILE_NAME, *RECORDING_COLUMNS, *SESSION_COLUMNS, *STORE_NAMES}
    for row in rows:
        session = row["session_id"]
        own = {name: row[name].partition("/") for name in ("recording", "grasp_id")}
        if any(before != session for before, _, _ in own.values()):
            raise ValueError(f"recording and grasp_id do not begin with {session}/")
        known = {name: row[name] for name in ("object", "quality") if row.get(name)}
        yield (
            session,
            Recording(
                recording_id=own["recording"][2],
                file=row[FILE_NAME],
                sha256=row["sha256"],
                grasp_id=own["grasp_id"][2],
                sample=int(row["sample"]),
                labels={name: text for name, text in row.items() if name not in standard},
                **known,
            ),
        )
