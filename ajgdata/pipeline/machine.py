"""Speed of the machine: a fixed computation on one core, compared with a reference speed.

Times are CPU times, so other programs hardly change them.
"""

from __future__ import annotations

import os
import platform
import time
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

# Each of the three parts of the computation takes about a third of a second at speed 1.
#: Number of Fourier transforms of 2^14 complex numbers.
TRANSFORMS = 1162
#: Number of products of matrices of 256 x 256.
PRODUCTS = 397
#: Number of additions in Python.
ADDITIONS = 8_333_333
#: Description of the processor on Linux.
CPU_INFO = Path("/proc/cpuinfo")


def machine_line() -> str:
    """Return the machine's cores, processor and speed as a line of the summary."""
    spent_s = calibrate()
    return (
        f"machine: {os.cpu_count()} cores, {cpu_name()}, {1 / spent_s:.2f} times the "
        f"reference speed (calibration {spent_s:.2f} s)"
    )


def calibrate() -> float:
    """Return the CPU time of the fixed computation on one core, in s."""
    random = np.random.default_rng(0)
    signal = random.normal(size=2**14) + 0j
    matrix = random.normal(size=(256, 256))
    with threadpool_limits(limits=1):
        start_s = time.process_time()
        for _ in range(TRANSFORMS):
            np.fft.fft(signal)
        for _ in range(PRODUCTS):
            matrix @ matrix
        total = 0
        for number in range(ADDITIONS):
            total += number
        return time.process_time() - start_s


def cpu_name() -> str:
    """Return the name of the processor, else its architecture."""
    lines = CPU_INFO.read_text(encoding="utf-8").splitlines() if CPU_INFO.is_file() else []
    names = [line.partition(": ")[2] for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
