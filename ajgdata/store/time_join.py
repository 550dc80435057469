"""Join of the rows of a table to recordings by time: the nearest row within a tolerance.

Times are exact decimal seconds, so a row at the distance of the tolerance is joined.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from decimal import Decimal
from pathlib import Path

from ajgdata.store.file_segments import FilePart
from ajgdata.store.label_table import read_label_table
from ajgdata.types import DataError, JoinSettings

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
#: Numbers from here on are not seconds: milliseconds, or the digits of a date.
TOO_LARGE_S = Decimal(10) ** 11
#: Characters of a date without a time of day.
_DATE_LENGTH = 10

Cells = Mapping[str, str]


@dataclass
class JoinResult:
    """Joined cells by recording, and the recordings that have none, with the reason.

    A recording without cells has an entry in `missing`. `notes` are names and reasons.
    """

    cells: dict[FilePart, Cells] = field(default_factory=dict)
    missing: list[tuple[str, str]] = field(default_factory=list)
    notes: list[tuple[str, str]] = field(default_factory=list)


def parse_time(text: str, utc_offset: str = "") -> Decimal:
    """Return a time in seconds: a number, or ISO 8601 as seconds since 1970 (UTC).

    `utc_offset` is the offset of times without an offset, e.g. `+01:00` or `Z`. Raises ValueError
    for any other text.

    >>> parse_time("2026-01-15T12:00:00.5+01:00"), parse_time("1768474800.5")
    (Decimal('1768474800.5'), Decimal('1768474800.5'))
    >>> parse_time("2026-01-15 12:00:00.5", utc_offset="+01:00")
    Decimal('1768474800.5')
    """
    text = text.strip()
    if not text:
        raise ValueError("there is no time")
    if _NUMBER.fullmatch(text):
        seconds = Decimal(text)
        if abs(seconds) >= TOO_LARGE_S:
            raise ValueError(f"{text!r} is too large for seconds")
        return seconds
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        raise ValueError(f"{text!r} is neither a number of seconds nor ISO 8601") from None
    if len(text) <= _DATE_LENGTH:
        raise ValueError(f"{text!r} has no time of day")
    if moment.tzinfo is None:
        if not utc_offset:
            raise ValueError(f"{text!r} has no time zone: set join.utc_offset")
        moment = datetime.fromisoformat(f"{text}{utc_offset}")
    past = moment - _EPOCH
    return past.days * 86_400 + past.seconds + Decimal(past.microseconds) / 1_000_000


def join_by_time(
    folder: Path, times: Mapping[FilePart, str], settings: JoinSettings, *, of_files: bool = False
) -> JoinResult:
    """Return the cells of the nearest row of `settings.table` for each recording.

    `times` are the texts of the times of recordings. If they are `of_files`, the start of the
    segment is added. `settings.latency_s` is subtracted. Rows with equal times and equal cells
    count as one. A recording has no cells if it has no time, if no row is within the tolerance, or
    if two different rows are equally near.
    Raises DataError for a table without the columns, and for a row without a time.
    """
    path = folder / settings.table
    instants = _instants(path, settings)
    times_s = sorted(instants)
    result = JoinResult()
    tolerance_s = Decimal(str(settings.tolerance_s))
    used: Counter[Decimal] = Counter()
    for recording, text in sorted(times.items()):
        name = recording.text
        try:
            time_s = parse_time(text, settings.utc_offset)
            if of_files:
                time_s += Decimal(str(recording.segment.start_s))
            time_s -= Decimal(str(settings.latency_s))
        except ValueError as error:
            result.missing.append((name, f"{error}; its joined columns are empty"))
            continue
        distance_s, nearest = _nearest(times_s, time_s)
        if distance_s > tolerance_s:
            reason = f"no row of {settings.table} is within {settings.tolerance_s:g} s"
            named = f"{name} (nearest row: {distance_s.normalize():f} s)"
            result.missing.append((named, f"{reason}; its joined columns are empty"))
            continue
        rows = [row for instant in nearest for row in instants[instant]]
        if len({tuple(cells.items()) for _, cells in rows}) > 1:
            lines = ", ".join(str(line) for line, _ in rows)
            named = f"{name} (lines {lines})"
            reason = f"several different rows of {settings.table} are equally near"
            result.missing.append((named, f"{reason}; its joined columns are empty"))
            continue
        result.cells[recording] = rows[0][1]
        used[nearest[0]] += 1
    repeated = sum(len(rows) - 1 for rows in instants.values())
    if repeated:
        noun = "row has" if repeated == 1 else "rows have"
        result.notes.append((settings.table, f"{repeated} {noun} the time of another row"))
    shared = sum(count > 1 for count in used.values())
    if shared:
        noun = "row is" if shared == 1 else "rows are"
        result.notes.append((settings.table, f"{shared} {noun} joined to several recordings each"))
    return result


def _instants(path: Path, settings: JoinSettings) -> dict[Decimal, list[tuple[int, Cells]]]:
    """Return the rows of the table, as lines and joined cells, by time."""
    table = read_label_table(path, [settings.time, *settings.columns])
    if not table.rows:
        raise DataError(path, "has no rows", "export the table again")
    names = list(table.rows[0][1])
    for name in (settings.time, *settings.columns):
        if name not in names:
            raise DataError(path, f"has no column {name!r}", f"use one of {names}")
    columns = settings.columns or [name for name in names if name != settings.time]
    instants: dict[Decimal, list[tuple[int, Cells]]] = defaultdict(list)
    for line, cells in table.rows:
        try:
            time_s = parse_time(cells[settings.time], settings.utc_offset)
        except ValueError as error:
            fix = "correct the cell, or delete the line"
            raise DataError(f"{path}:{line}", f"{settings.time}: {error}", fix) from None
        instants[time_s].append((line, {name: cells[name] for name in columns}))
    return dict(instants)


def _nearest(times_s: Sequence[Decimal], time_s: Decimal) -> tuple[Decimal, list[Decimal]]:
    """Return the smallest distance of the sorted `times_s` from a time, and the times with it."""
    place = bisect_left(times_s, time_s)
    neighbours = times_s[max(place - 1, 0) : place + 1]
    distance_s = min(abs(neighbour - time_s) for neighbour in neighbours)
    return distance_s, [t for t in neighbours if abs(t - time_s) == distance_s]
