"""Labels of recordings: columns of a data set, and labels that cannot be used."""

from __future__ import annotations

import dataclasses
import math
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress

import numpy as np

from ajgdata.store.features import FeatureColumn, FeatureRows, text_column
from ajgdata.types import SEGMENT_COLUMNS, TABLE_ROW, WHOLE_FILE, Finding, Segment, Target, part_id
from ajgdata.types.robot_columns import is_robot_column, robot_unit

#: Columns of the table of labels that identify rows; all other columns become coordinates.
IDENTITY = ("recording_id", "grasp_id", "placement_id", "sample")
#: Column of the levels of all channels of a file.
CHANNEL_LEVELS = "channel_levels"
#: Meanings of the columns of every feature file, for readers without this library.
MEANINGS = {
    "recording": "recording: session/recording_id",
    "session_id": "uninterrupted acquisition with one gripper",
    "grasp_id": "one closing of the gripper on an object: session/grasp_id",
    "placement_id": "one placing of an object: session/placement_id; empty if unknown",
    "sample": "number of the repeat within the grasp",
    "object": "what was held",
    "quality": "ok or clipped",
    "source": "virtual or virtual-import (simulated), soundcard or import",
    "gripper": "gripper",
    "medium": "granular medium in the gripper",
    "start_s": "start of the recording in the recorded file; missing: the beginning of this file",
    "end_s": "end of the recording in the recorded file; missing: the end of this file",
    TABLE_ROW: "row of the imported table, counted from 1 below the header",
    CHANNEL_LEVELS: "level of each channel of the file, relative to full scale and without offset",
}
#: Meaning of the columns with the numbers of the robot's program.
ROBOT_MEANING = "measured by the robot's program"


def bad_labels(
    session: str, recording_id: str, row: Mapping[str, str], targets: Mapping[str, Target]
) -> list[Finding]:
    """Return a warning for each cell that is not a value of its target.

    Only tasks of this target exclude the recording.
    """
    fix = "correct recordings.csv, or declare the text under `missing` of the target"
    findings = []
    for name, target in targets.items():
        try:
            parse_label(row.get(name, ""), target)
        except ValueError:
            problem = f"{name} = {row[name]!r} is not a finite number: no task of {name} uses it"
            findings.append(
                Finding(session, recording_id, "", "warning", "bad_label", problem, fix)
            )
    return findings


def parse_label(text: str, target: Target) -> float | str:
    """Return a cell as the value of a target; a missing value is NaN or "".

    Raises ValueError for a regression target that is not a finite number.
    """
    missing = text == "" or text in target.missing
    if target.kind == "classification":
        return "" if missing else text
    if missing:
        return math.nan
    return number(text)


def _value(text: str, target: Target) -> float | str:
    """Return a cell as the value of a target; a cell that is not a value is missing."""
    try:
        return parse_label(text, target)
    except ValueError:
        return math.nan


def comparable_labels(row: Mapping[str, str], targets: Mapping[str, Target]) -> tuple[str, ...]:
    """Return the targets of a row as texts that are equal for equal values.

    `10` and `10.0` are one number. All missing values are equal, and a cell that is not a value
    is missing.
    """
    return tuple(str(_value(row.get(name, ""), target)) for name, target in targets.items())


def number(text: str) -> float:
    """Return the finite number of a text. Raises ValueError for any other text, also for `1_0`."""
    value = float(text)
    if not math.isfinite(value) or "_" in text:
        raise ValueError(f"{text!r} is not a finite number")
    return value


def levels_text(levels_db: Sequence[float]) -> str:
    """Return levels in dB as a text, `-20.13 dB, -31.5 dB`."""
    return ", ".join(f"{level:g} dB" for level in levels_db)


def parse_levels(text: str) -> tuple[float, ...]:
    """Return the levels in dB of a text of `levels_text`. Raises ValueError for any other text."""
    return tuple(float(level.removesuffix(" dB")) for level in text.split(", ") if level)


def take_rows(table: FeatureRows, rows: np.ndarray) -> FeatureRows:
    """Return the rows with the numbers `rows` (m,), or with True in `rows` (n,)."""
    columns = {
        name: FeatureColumn(column.values[rows], column.attrs)
        for name, column in table.columns.items()
    }
    return dataclasses.replace(table, feature=table.feature[rows], columns=columns)


def label_columns(
    rows: Sequence[Mapping[str, str]], names: Collection[str], targets: Mapping[str, Target]
) -> dict[str, FeatureColumn]:
    """Return the columns (n,) of recordings, of which each has a row of labels with `session_id`.

    The name of the session before `recording`, `grasp_id` and `placement_id` makes them unique in
    the data set. A row that lacks a column of `names` has a missing value. A column of the robot's
    program has numbers, unless a cell is another text. The times of segments are numbers.
    """
    samples = np.asarray([int(row["sample"]) for row in rows], np.int32)
    columns = {
        "recording": [f"{row['session_id']}/{row['recording_id']}" for row in rows],
        "grasp_id": [f"{row['session_id']}/{row['grasp_id']}" for row in rows],
        "session_id": [row["session_id"] for row in rows],
    }
    if "placement_id" in names:
        columns["placement_id"] = [placement_name(row) for row in rows]
    columns |= {
        name: [row.get(name, "") for row in rows]
        for name in names
        if name not in targets and name not in IDENTITY
    }
    return {
        **{name: _standard(name, values) for name, values in columns.items()},
        **{
            name: target_column([_value(row.get(name, ""), target) for row in rows], target)
            for name, target in targets.items()
            if name in names
        },
        "sample": FeatureColumn(samples, {"long_name": MEANINGS["sample"], "units": "1"}),
    }


def placement_name(row: Mapping[str, str]) -> str:
    """Return the placement of a row of labels, unique in its data set; "" if it is unknown."""
    placement = row.get("placement_id", "")
    return f"{row['session_id']}/{placement}" if placement else ""


def _standard(name: str, values: Sequence[str]) -> FeatureColumn:
    """Return a column that is not a target: text, times of segments, or numbers of a robot."""
    if name in SEGMENT_COLUMNS:
        return _numbers(values, {"long_name": MEANINGS[name], "units": "s"})
    if name == TABLE_ROW:
        return _numbers(values, {"long_name": MEANINGS[name], "units": "1"})
    if is_robot_column(name) and any(values):
        attrs = {"long_name": ROBOT_MEANING}
        unit = robot_unit(name)
        if unit:
            attrs["units"] = unit
        with suppress(ValueError):
            return _numbers(values, attrs)
    attrs = {"long_name": MEANINGS[name]} if name in MEANINGS else {}
    return text_column(values, **attrs)


def _numbers(values: Sequence[str], attrs: Mapping[str, str]) -> FeatureColumn:
    """Return a column of numbers, NaN for an empty cell. Raises ValueError for another text."""
    numbers = [number(text) if text else math.nan for text in values]
    return FeatureColumn(np.asarray(numbers, np.float64), attrs)


def target_column(values: Sequence[float | str], target: Target) -> FeatureColumn:
    """Return values of a target with their unit and meaning."""
    attrs = {"long_name": target.description} if target.description else {}
    if target.kind == "classification":
        return text_column([str(v) for v in values], **attrs, role="target")
    if target.unit:
        attrs["units"] = target.unit
    return FeatureColumn(np.asarray(values, np.float64), {**attrs, "role": "target"})


def without_copies(table: FeatureRows, targets: Sequence[str]) -> tuple[FeatureRows, list[Finding]]:
    """Return the table without recordings with equal bytes (see `copies`), and their issues."""
    names = [str(name) for name in table.columns["recording"].values]
    digests = sound_ids(table)
    columns = [table.columns[name].values for name in targets if name in table.columns]
    labels = [tuple(str(values[i]) for values in columns) for i in range(len(names))]
    findings = copies(names, digests, labels)
    keep = np.asarray([i for i in range(len(names)) if i not in findings], int)
    return take_rows(table, keep), list(findings.values())


def sound_ids(table: FeatureRows) -> list[str]:
    """Return texts that are equal for equal sounds: the sha256 of the file, and the times of a
    segment or the row of a table."""
    digests = [str(digest) for digest in table.columns["sha256"].values]
    if TABLE_ROW in table.columns:
        rows = table.columns[TABLE_ROW].values.tolist()
        numbers = [None if math.isnan(row) else int(row) for row in rows]
        parts = zip(digests, numbers, strict=True)
        return [part_id(digest, WHOLE_FILE, number) for digest, number in parts]
    if SEGMENT_COLUMNS[0] not in table.columns:
        return digests
    starts, ends = (table.columns[name].values.tolist() for name in SEGMENT_COLUMNS)
    segments = [
        Segment(0.0 if math.isnan(start) else start, math.inf if math.isnan(end) else end)
        for start, end in zip(starts, ends, strict=True)
    ]
    return [segment.sound_id(digest) for segment, digest in zip(segments, digests, strict=True)]


def copies(
    recordings: Sequence[str],
    digests: Sequence[str],
    labels: Sequence[tuple[str, ...]],
    equal: str = "bytes",
) -> dict[int, Finding]:
    """Return issues, by row, of recordings that cannot be used because others have equal bytes.

    `digests` are the texts of `sound_ids`: segments of a file with different times are no copies.
    `equal` is the noun for what is equal if two of them are.

    Copies with equal labels would be in several folds, so all except the first one have an issue.
    If labels of copies differ, the right label is unknown, so all of them have an issue.
    `recordings` are `<session>/<recording_id>`.
    """
    rows_of: dict[str, list[int]] = defaultdict(list)
    for row, digest in enumerate(digests):
        rows_of[digest].append(row)
    findings = {}
    for rows in rows_of.values():
        differ = len({labels[row] for row in rows}) > 1
        for row in rows if differ else rows[1:]:
            other = rows[1] if row == rows[0] else rows[0]
            problem = f"the same {equal} as {recordings[other]} ({len(rows)} recordings)"
            findings[row] = copy_finding(recordings[row], problem, differ=differ)
    return findings


def copy_finding(recording: str, problem: str, *, differ: bool) -> Finding:
    """Return the issue of a recording `<session>/<recording_id>` that is a copy.

    `problem` names the equal recording. The issue is an error if the labels of the copies `differ`,
    and a warning if they are equal.
    """
    session, _, name = recording.partition("/")
    if differ:
        problem = f"{problem}, labelled otherwise"
        fix = "correct the label in recordings.csv, or set quality to reject for all but one"
        return Finding(session, name, "", "error", "two_labels", problem, fix)
    fix = "set quality to reject in recordings.csv for all but one"
    return Finding(session, name, "", "warning", "copy", f"{problem}; left out", fix)
