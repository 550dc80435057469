"""Cost of fitting and predicting: times and memory of one thread on this machine."""

from __future__ import annotations

import resource
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

REPEATS = 5  # timed predictions; their median ignores one interruption or two
TIMING_BUDGET_S = 1.0  # stop repeating a slow prediction after this long


@dataclass(frozen=True)
class Cost:
    """Times and memory of a cross-validation, one thread, on whatever machine this was.

    `train_s` is wall time and `train_cpu_s` processor time of fitting; the latter tells whether
    something else was using the machine. `inference_s_per_recording`: a whole test part
    predicted at once; `latency_s`: one recording predicted alone; both the median over repeats,
    then over folds. `peak_rss_mb` (1e6 bytes) is the largest resident memory that the process
    ever had, libraries and features included; `rss_increase_mb` by how much that exceeds what it
    held on entry, 0 if it had once been larger.
    """

    train_s: float
    train_cpu_s: float
    train_s_per_fold: tuple[float, ...]
    inference_s_per_recording: float
    latency_s: float
    peak_rss_mb: float
    rss_increase_mb: float


@dataclass(frozen=True)
class FoldCost:
    """Times of one fold in seconds."""

    train_s: float
    train_cpu_s: float
    inference_s: float  #: a recording, the whole test part predicted at once
    latency_s: float  #: one recording predicted alone


def total_cost(folds: Sequence[FoldCost], rss_mb: float) -> Cost:
    """Return the cost of all folds; `rss_mb` is the memory that the process held before."""
    peak_mb = memory_mb("VmHWM")
    return Cost(
        train_s=sum(fold.train_s for fold in folds),
        train_cpu_s=sum(fold.train_cpu_s for fold in folds),
        train_s_per_fold=tuple(fold.train_s for fold in folds),
        inference_s_per_recording=statistics.median(fold.inference_s for fold in folds),
        latency_s=statistics.median(fold.latency_s for fold in folds),
        peak_rss_mb=peak_mb,
        rss_increase_mb=max(0.0, peak_mb - rss_mb),
    )


def median_s(call: Callable[[], object]) -> float:
    """Return the median wall time of some calls, in s."""
    times: list[float] = []
    while len(times) < REPEATS and sum(times) < TIMING_BUDGET_S:
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def memory_mb(field: str) -> float:
    """Return the resident memory of this process now (VmRSS) or at most so far (VmHWM), in 1e6
    bytes.

    Elsewhere than on Linux both are the most so far. There `ru_maxrss` is the only source; on
    Linux it would include what the process held before it became Python.
    """
    status = Path("/proc/self/status")
    if not status.exists():
        unit = 1 if sys.platform == "darwin" else 1024
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6
    lines = (line.split() for line in status.read_text().splitlines())
    return next(int(line[1]) for line in lines if line[0] == f"{field}:") * 1024 / 1e6
