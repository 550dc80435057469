"""What a run took, in one line for the console: time, memory, jobs, and recordings read."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ajgdata.pipeline.run_summary import Data, many
from ajgdata.store.benchmarks import used_s
from ajgdata.store.files import read_text

#: What `extract_features` says at its end.
READ = re.compile(r"^(\d+) recordings read, \d+ features reused$", re.MULTILINE)
#: A process's largest memory is in units of so many bytes; see getrusage(2).
UNIT_BYTES = 1 if sys.platform == "darwin" else 1024


@dataclass(frozen=True)
class Effort:
    """What a run took: s of wall and of processor time, MB (1e6 bytes) of its largest process; how
    many jobs ran, how many were current, and how many recordings were read anew; `whole`
    unless jobs that were to run did not.

    What other machines took is not known here: `cpu_s` and `peak_mb` are None then.
    """

    wall_s: float
    cpu_s: float | None
    peak_mb: float | None
    jobs: int
    kept: int
    read: int
    whole: bool = True


def effort(
    wall_s: float,
    jobs: int,
    kept: int,
    logs: Iterable[Path],
    *,
    local: bool,
    whole: bool = True,
) -> Effort:
    """Return what this process and those that it waited for took; `logs` are those of the jobs
    that made features."""
    read = sum(int(found) for log in logs for found in READ.findall(_text(log)))
    if not local:
        return Effort(wall_s, None, None, jobs, kept, read, whole)
    return Effort(wall_s, used_s(), _peak_mb(), jobs, kept, read, whole)


def _peak_mb() -> float | None:
    """Return the memory of the largest process; None where the system does not tell."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    whose = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    return max(resource.getrusage(who).ru_maxrss for who in whose) * UNIT_BYTES / 1e6


def _text(log: Path) -> str:
    return read_text(log) if log.is_file() else ""


def effort_line(took: Effort, data: Sequence[Data]) -> str:
    """Return it for the console; `data` are the recordings of the run.

    How many recordings were not read because they were kept is known of a whole run only.
    """
    told = [f"this run: {_duration(took.wall_s)}"]
    if took.cpu_s is not None:
        told.append(f"{_duration(took.cpu_s)} of processor time")
    if took.peak_mb is not None:
        told.append(f"{took.peak_mb:,.0f} MB at most")
    told.append(f"{many(took.jobs, 'job')} run, {took.kept:,} current")
    read = f"{many(took.read, 'recording')} read"
    if took.whole:
        recordings = sum(one.used + one.left_out for one in data)
        read += f", {max(recordings - took.read, 0):,} kept"
    return "; ".join([*told, read])


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes} min"
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"
