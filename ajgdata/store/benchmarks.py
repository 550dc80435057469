"""Benchmark files of Snakemake: time and memory of each job.

Snakemake looks at a job every half a second, later every half a minute, and tells the processor
time that it saw last. So a job itself says in the last line of its log what it took.
"""

from __future__ import annotations

import csv
import io
import math
import os
import re
from dataclasses import dataclass
from pathlib import Path

from ajgdata.store.files import read_text
from ajgdata.types import DataError

MIB = 2**20 / 1e6  #: Snakemake's unit of memory, in 1e6 bytes
_USED = re.compile(r"^(\d+\.\d+) s of processor time$", re.MULTILINE)


@dataclass(frozen=True)
class Job:
    """One job: its rule, its wildcards, s of wall and processor time, MB (1e6 bytes), and when it
    ended (s since 1970). What a short job did not live to tell is NaN."""

    rule: str
    parts: tuple[str, ...]
    wall_s: float
    cpu_s: float
    peak_mb: float
    ended_s: float


def used_s() -> float:
    """Return the processor time (s) of this process and of those that it waited for."""
    took = os.times()
    return took.user + took.system + took.children_user + took.children_system


def used_line() -> str:
    """Return the last line of a job's log."""
    return f"{used_s():.2f} s of processor time"


def read_benchmarks(folder: Path, logs: Path) -> list[Job]:
    """Return jobs by the file names `<rule>/<wildcards with dots>.tsv` and `<rule>.tsv`, in their
    order. What a log of the same name in `logs` says of the job's processor time is believed.

    Raises DataError for a file that is none of Snakemake's.
    """
    jobs = []
    for path in sorted(folder.rglob("*.tsv")):
        alone = path.parent == folder
        rule, parts = (path.stem, "") if alone else (path.parent.name, path.stem)
        for row in csv.DictReader(io.StringIO(read_text(path)), delimiter="\t"):
            try:
                wall, cpu, resident, shared = (
                    _number(row[k]) for k in ("s", "cpu_time", "max_rss", "max_pss")
                )
            except (KeyError, ValueError, TypeError):
                problem = "is no benchmark file of Snakemake's"
                raise DataError(path, problem, "delete it and run again") from None
            wildcards, ended = tuple(filter(None, parts.split("."))), path.stat().st_mtime
            log = logs / path.relative_to(folder).with_suffix(".log")
            told = _USED.findall(read_text(log)) if log.is_file() else []
            cpu = float(told[-1]) if told else cpu
            # What processes of a job share counts once, where the system tells.
            memory = resident if math.isnan(shared) else shared
            jobs.append(Job(rule, wildcards, wall, cpu, memory * MIB, ended))
    return jobs


def _number(text: str) -> float:
    return math.nan if text in ("NA", "-") else float(text)
