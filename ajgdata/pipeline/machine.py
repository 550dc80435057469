"""Speed of the machine: a fixed computation on one core, compared with a reference speed.

Rates are per CPU time, so other programs hardly change them.
"""

from __future__ import annotations

import math
import os
import platform
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

#: Speed 1, in operations per second: Fourier transforms of 2^14 complex numbers (5 n log2 n
#: operations each), products of matrices of 256 x 256 (2 n^3 each) and additions in Python. We
#: chose these round values once; results of all machines refer to them.
REFERENCE = {"transforms": 4e9, "products": 4e10, "additions": 2.5e7}
TIME_S = 1.0  #: of the calibration at speed 1; each kind takes the same share
CPU_INFO = Path("/proc/cpuinfo")  #: on Linux


def machine_line() -> str:
    """Return the machine's cores, processor and speed as a line of the summary."""
    start_s = time.process_time()
    speed = relative_speed(calibrate())
    spent_s = time.process_time() - start_s
    return (
        f"machine: {os.cpu_count()} cores, {cpu_name()}, {speed:.2f} times the reference speed "
        f"(calibration {spent_s:.2f} s)"
    )


def relative_speed(rates: Mapping[str, float]) -> float:
    """Return the geometric mean of rates (operations per second) divided by REFERENCE."""
    return math.prod(rates[name] / REFERENCE[name] for name in REFERENCE) ** (1 / len(REFERENCE))


def calibrate() -> dict[str, float]:
    """Return the rates of one core, in operations per second; takes TIME_S at speed 1."""
    random = np.random.default_rng(0)
    signal, matrix = random.normal(size=2**14) + 0j, random.normal(size=(256, 256))
    with threadpool_limits(limits=1):
        return {
            "transforms": _rate("transforms", 5 * 2**14 * 14, lambda: np.fft.fft(signal)),
            "products": _rate("products", 2 * 256**3, lambda: matrix @ matrix),
            "additions": _rate("additions", 10**5, lambda: _count(10**5)),
        }


def _rate(name: str, operations: int, compute: Callable[[], object]) -> float:
    """Return operations per second of as many calls as take their share of TIME_S at speed 1."""
    calls = round(REFERENCE[name] * TIME_S / len(REFERENCE) / operations)
    compute()
    start_s = time.process_time()
    for _ in range(calls):
        compute()
    return calls * operations / (time.process_time() - start_s)


def _count(number: int) -> int:
    total = 0
    for _ in range(number):
        total += 1
    return total


def cpu_name() -> str:
    """Return the name of the processor, else its architecture."""
    lines = CPU_INFO.read_text().splitlines() if CPU_INFO.is_file() else []
    names = [line.partition(": ")[2] for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
