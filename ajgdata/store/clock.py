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

#: Files are dated by a clock that may be behind by so much (s), the tick of the system.
TICK_S = 0.02


def latest_s(folder: Path, flat: Collection[Path] = ()) -> float:
    """Return the latest date (s since 1970) of the files below `folder`, 0 if there are none; of
    the folders `flat`, which may hold much, only the files beside their own folders count."""
    return max((date for _, date in _dated(folder, flat)), default=0.0)


def mend_dates(folder: Path, flat: Collection[Path] = ()) -> int:
    """Date files below `folder`, found as by `latest_s`, that bear a date to come as of now; return
    how many did. Those of other users stay as they are."""
    now_s, mended = time.time(), 0
    for path, date in _dated(folder, flat):
        if date > now_s:
            with suppress(OSError):
                os.utime(path, (now_s - TICK_S,) * 2)
                mended += 1
    return mended


def _dated(folder: Path, flat: Collection[Path]) -> Iterator[tuple[str, float]]:
    try:
        with os.scandir(folder) as entries:
            held = list(entries)
    except OSError:  # not there, or not ours
        return
    for one in held:
        if not one.is_dir():
            with suppress(OSError):  # has just gone
                yield one.path, one.stat().st_mtime
        elif folder not in flat:
            yield from _dated(folder / one.name, flat)
