"""Files dated later than now: what a clock leaves that was wrong, and was set back since.

What is newer is made from what is older: as long as results bear dates to come, no change would
count.
"""

from __future__ import annotations

import os
import time
from collections.abc import Collection, Iterator
from contextlib import suppress
from pathlib import Path

#: Files are dated by a clock that may be behind by so much, the tick of the system.
TICK_NS = 20_000_000
#: New dates lie so far apart where there is room, and at least as far as float seconds, by which
#: Snakemake compares them, can tell.
STEP_NS, LEAST_STEP_NS = 1_000_000, 1_000


def latest_s(folder: Path, flat: Collection[Path] = ()) -> float:
    """Return the latest date (s since 1970) of the files below `folder`, 0 if there are none; of
    the folders `flat`, which may hold much, only the files beside their own folders count. What a
    link leads to does not belong to `folder`."""
    return max((status.st_mtime for _, status in _dated(folder, flat)), default=0.0)


def mend_dates(folder: Path, flat: Collection[Path] = ()) -> int:
    """Date files below `folder`, found as by `latest_s`, that bear a date to come as of now; return
    how many did. Their order stays, after all others' dates where these leave room. Files of other
    users stay as they are."""
    now, mended = time.time_ns(), 0
    dates = {path: status.st_mtime_ns for path, status in _dated(folder, flat)}
    ranks = _ranks({date for date in dates.values() if date > now})
    last = now - TICK_NS
    room = last - max((date for date in dates.values() if date <= now), default=0)
    step = max(LEAST_STEP_NS, min(STEP_NS, room // (len(ranks) + 1)))
    for path, date in dates.items():
        if date in ranks:
            new = last - step * ranks[date]
            with suppress(OSError):
                os.utime(path, ns=(new, new), follow_symlinks=False)
                mended += 1
    return mended


def _ranks(dates: Collection[int]) -> dict[int, int]:
    """Return the place of each date, 0 for the last."""
    return {date: rank for rank, date in enumerate(sorted(dates, reverse=True))}


def _dated(folder: Path, flat: Collection[Path]) -> Iterator[tuple[str, os.stat_result]]:
    try:
        with os.scandir(folder) as entries:
            held = list(entries)
    except OSError:  # not there, or not ours
        return
    for one in held:
        if not one.is_dir(follow_symlinks=False):
            with suppress(OSError):  # has just gone
                yield one.path, one.stat(follow_symlinks=False)
        elif folder not in flat:
            yield from _dated(folder / one.name, flat)
