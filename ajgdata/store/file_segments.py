"""Segments of long files that an import finds: label tracks of Audacity, tables, a fixed period."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from ajgdata.store.files import plain_text, read_text
from ajgdata.store.labels import number
from ajgdata.types import WHOLE_FILE, DataError, Segment, SegmentSettings

#: Names of the columns of a table with the start and the end of a segment, in lower case.
START_COLUMNS = ("start", "start_s")
END_COLUMNS = ("end", "end_s")
#: A rest of a period that is shorter than this is rounding: Audacity writes microseconds.
TOLERANCE_S = 1e-6
#: Digits after the decimal point of computed times.
_DIGITS = 9


class FilePart(NamedTuple):
    """A file of a folder, or a segment of it; `path` is relative to the folder."""

    path: Path
    segment: Segment = WHOLE_FILE

    @property
    def text(self) -> str:
        """The path, with the times of a segment."""
        if self.segment == WHOLE_FILE:
            return self.path.as_posix()
        return f"{self.path.as_posix()} ({self.segment})"


class TrackLabel(NamedTuple):
    """A part of a file with one label. A point of a label track ends where it begins."""

    start_s: float
    end_s: float
    label: str


def read_label_track(path: Path) -> list[TrackLabel]:
    """Return the labels of a text file that Audacity exported, sorted by time.

    A line is start, end and label, with tabs between them. Lines that begin with a backslash have
    frequencies, and are ignored. Raises DataError for another line and for a file without labels.
    """
    labels: list[TrackLabel] = []
    line_of: dict[tuple[float, float], int] = {}  # the first line with these times
    for line_number, line in enumerate(read_text(path).splitlines(), 1):
        if not line.strip() or line.startswith("\\"):
            continue
        cells = line.split("\t", maxsplit=2)
        where = f"{path}:{line_number}"
        if len(cells) < 2:
            problem = f"{line!r} is not start, end and label with tabs between them"
            raise DataError(where, problem, "export the labels in Audacity as a text file")
        start_s, end_s = (_time_s(where, cell) for cell in cells[:2])
        if end_s < start_s:
            raise DataError(where, "the label ends before it begins", "exchange both times")
        first = line_of.setdefault((start_s, end_s), line_number)
        if first != line_number:
            problem = f"has the same times as line {first}"
            raise DataError(where, problem, "remove one of the two labels")
        label = plain_text(cells[2]) if len(cells) > 2 else ""
        labels.append(TrackLabel(start_s, end_s, label))
    if not labels:
        raise DataError(path, "has no labels", "export the labels in Audacity as a text file")
    return sorted(labels)


def cut_track(path: Path, settings: SegmentSettings) -> list[tuple[Segment, str]]:
    """Return the segments of a label track, each with its label.

    With a period, an interval has several segments, and a point is the beginning of one segment.
    Raises DataError for a point without a period, and for an interval that is shorter than the
    period.
    """
    segments = []
    for interval in read_label_track(path):
        is_point = interval.start_s == interval.end_s
        segment = Segment(interval.start_s, interval.end_s)
        if is_point:
            if settings.period_s is None:
                problem = f"the label at {interval.start_s:g} s is a point"
                fix = "drag it to an interval in Audacity, or add --period"
                raise DataError(path, problem, fix)
            end_s = interval.start_s + settings.offset_s + settings.period_s
            segment = Segment(interval.start_s, round(end_s, _DIGITS))
        parts = cut_by_period(segment, settings)
        if not parts:
            problem = f"the label from {segment} is shorter than --offset and --period"
            raise DataError(path, problem, "correct the label, --offset or --period")
        segments += [(part, interval.label) for part in parts]
    return segments


def cut_by_period(segment: Segment, settings: SegmentSettings) -> list[Segment]:
    """Return the complete periods of a segment, from `offset_s` after its start to its finite end.

    Without a period, the segment is complete.

    >>> cut_by_period(Segment(10, 12.5), SegmentSettings(period_s=1, offset_s=0.25))
    [Segment(start_s=10.25, end_s=11.25), Segment(start_s=11.25, end_s=12.25)]
    """
    period_s = settings.period_s
    if period_s is None:
        return [segment]
    first_s = segment.start_s + settings.offset_s
    count = max(0, math.floor((segment.end_s - first_s + TOLERANCE_S) / period_s))
    edges = [round(first_s + number * period_s, _DIGITS) for number in range(count + 1)]
    return [Segment(start_s, end_s) for start_s, end_s in pairwise(edges)]


def take_segment(where: str, cells: Mapping[str, str]) -> tuple[Segment, dict[str, str]]:
    """Return the segment of a row of a table, and the other cells of the row.

    Empty times are the start and the end of the file. Raises DataError if the table lacks a column
    with times, and for times that are not numbers or that are no segment.
    """
    texts: list[str] = []
    others = dict(cells)
    for names in (START_COLUMNS, END_COLUMNS):
        found = [column for column in cells if column.strip().lower() in names]
        if len(found) != 1:
            problem = f"has {len(found) or 'no'} columns {' or '.join(names)}: {list(cells)}"
            raise DataError(where, problem, "name one column of each time, in seconds")
        texts.append(others.pop(found[0]).strip())
    start_s = _time_s(where, texts[0]) if texts[0] else 0.0
    end_s = _time_s(where, texts[1]) if texts[1] else math.inf
    if end_s <= start_s:
        problem = f"the segment {Segment(start_s, end_s)} is empty"
        raise DataError(where, problem, "correct the times: the end must be after the start")
    return Segment(start_s, end_s), others


def _time_s(where: str, text: str) -> float:
    """Return a time of a cell in s. Raises DataError for another text, and for a negative time."""
    try:
        time_s = number(text)
    except ValueError:
        fix = "write seconds, such as 12.5"
        raise DataError(where, f"{text!r} is not a time", fix) from None
    if time_s < 0:
        raise DataError(where, f"{text} s is before the file", "write times from 0 on")
    return time_s
