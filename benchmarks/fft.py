"""Transforms of a recording's frames by several FFT libraries, and what each would gain.

Run `python benchmarks/fft.py`; `pip install ducc0 pyfftw mkl_fft` to have those beside it. The
feature's own kernel (`ajgdata.features.spectrum`) stands beside the same loop with another
transform in it. Times are processor time, routes take turns, ratios are medians of those within
each turn: a busy machine disturbs all alike. The time of importing numba, torch and the libraries
is measured in processes of their own: a job of the workflow pays it once.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import process_time

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import scipy.fft
from features import AUDIO, HOP, RATE_HZ, SETTINGS, WINDOW, by_librosa, make_recordings
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy.signal import get_window

from ajgdata.features.spectrum import spectrum
from ajgdata.store.audio import read_audio

#: Frames (rows, window) -> transforms (rows, window/2 + 1); rows are at most those of the batch.
Transform = Callable[[NDArray[np.float32]], NDArray[np.complex64]]
SHAPE = get_window("hann", WINDOW, fftbins=True).astype(np.float32)
IMPORTS = ("numpy", "scipy.fft", "numba", "torch", "ducc0", "pyfftw", "mkl_fft")


def by_scipy(rows: int) -> Transform:
    return scipy.fft.rfft


def by_numpy(rows: int) -> Transform:
    out = np.empty((rows, WINDOW // 2 + 1), np.complex64)
    return lambda frames: np.fft.rfft(frames, out=out[: len(frames)])


def by_pairs(rows: int) -> Transform:
    """Two real frames as one complex one; its halves hold the sum and the difference of both."""

    def transform(frames: NDArray[np.float32]) -> NDArray[np.complex64]:
        even = len(frames) + len(frames) % 2
        padded = np.zeros((even, WINDOW), np.float32)
        padded[: len(frames)] = frames
        both = scipy.fft.fft(padded[: even // 2] + 1j * padded[even // 2 :])
        back = np.conj(np.roll(both[:, ::-1], 1, axis=1))
        first, second = (both + back) / 2, (both - back) / 2j
        return np.concatenate([first, second])[: len(frames), : WINDOW // 2 + 1]

    return transform


def by_ducc(rows: int) -> Transform:
    import ducc0

    out = np.empty((rows, WINDOW // 2 + 1), np.complex64)
    return lambda frames: ducc0.fft.r2c(
        frames, axes=(1,), forward=True, out=out[: len(frames)], nthreads=1
    )


def by_fftw(rows: int) -> Transform:
    """One frame at a time, which is its fastest."""
    import pyfftw

    given = pyfftw.empty_aligned(WINDOW, "float32")
    found = pyfftw.empty_aligned(WINDOW // 2 + 1, "complex64")
    plan = pyfftw.FFTW(given, found, flags=("FFTW_ESTIMATE",), threads=1)
    out = np.empty((rows, WINDOW // 2 + 1), np.complex64)

    def transform(frames: NDArray[np.float32]) -> NDArray[np.complex64]:
        for row, frame in zip(out, frames, strict=False):
            given[:] = frame
            plan.execute()
            row[:] = found
        return out[: len(frames)]

    return transform


def by_mkl(rows: int) -> Transform:
    import mkl_fft

    return lambda frames: mkl_fft.rfft(frames, axis=1)


LIBRARIES = {
    "scipy.fft": ("scipy", by_scipy, 32),
    "numpy.fft": ("numpy", by_numpy, 8),
    "scipy.fft, two frames in one": ("scipy", by_pairs, 32),
    "ducc0": ("ducc0", by_ducc, 8),
    "pyFFTW": ("pyfftw", by_fftw, 32),
    "mkl_fft": ("mkl_fft", by_mkl, 32),
}


def loop(samples: NDArray[np.float32], transform: Transform, rows: int) -> NDArray[np.float64]:
    """Return the sum of magnitudes (window/2 + 1,), as the feature's own loop makes it."""
    frames = sliding_window_view(samples, WINDOW)[::HOP]
    windowed = np.empty((rows, WINDOW), np.float32)
    total = np.zeros(WINDOW // 2 + 1)
    for start in range(0, len(frames), rows):
        count = len(frames[start : start + rows])
        np.multiply(frames[start : start + rows], SHAPE, out=windowed[:count])
        total += np.abs(transform(windowed[:count])).sum(axis=0)
    return total


def measured(routes: dict[str, Callable[[], object]], turns: int, per: int) -> dict[str, NDArray]:
    """Return processor time (turns,) in ms of one of `per` recordings."""
    found = {name: np.empty(turns) for name in routes}
    for turn in range(turns):
        for name, route in routes.items():
            begun = process_time()
            route()
            found[name][turn] = 1e3 * (process_time() - begun) / per
    return found


def of_recordings(folder: Path, count: int) -> dict[str, Callable[[], object]]:
    paths = make_recordings(folder, count, "PCM_24")
    samples = [read_audio(path, AUDIO).samples for path in paths]
    routes: dict[str, Callable[[], object]] = {
        "reading": lambda: [read_audio(path, AUDIO) for path in paths],
        "ours": lambda: [spectrum(one, RATE_HZ, SETTINGS) for one in samples],
    }
    expected = loop(samples[0].astype(np.float64), scipy.fft.rfft, 32)
    for name, (module, make, rows) in LIBRARIES.items():
        if importlib.util.find_spec(module):
            transform = make(rows)
            away = np.abs(loop(samples[0], transform, rows) - expected).max() / expected.max()
            assert away < 1e-5, f"{name} differs by {away:.1e}"
            routes[f"loop with {name}"] = lambda t=transform, r=rows: [
                loop(one, t, r) for one in samples
            ]
    if importlib.util.find_spec("librosa"):
        routes["librosa, with reading"] = lambda: by_librosa(paths)
    return routes


def import_s(module: str, repeats: int = 3) -> float:
    """Return the processor time of a process that imports it, above one that imports nothing."""

    def spent(code: str) -> float:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, "-c", code], check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    turns = [(spent(f"import {module}"), spent("import sys")) for _ in range(repeats)]
    return float(np.median([with_it - without for with_it, without in turns]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-n", "--recordings", type=int, default=20)
    parser.add_argument("--turns", type=int, default=15)
    asked = parser.parse_args()
    console = Console(width=100)
    with tempfile.TemporaryDirectory() as folder:
        routes = of_recordings(Path(folder), asked.recordings)
        found = measured(routes, asked.turns, asked.recordings)
    peer = "librosa, with reading"
    table = Table(title=f"one second at {RATE_HZ} Hz, {asked.turns} turns, one thread")
    for heading in ("route", "ms of CPU", "librosa / (reading + it)"):
        table.add_column(heading, justify="left" if heading == "route" else "right")
    for name, ms in found.items():
        whole = ms if name == peer else ms + found["reading"]
        ratio = np.median(found[peer] / whole) if peer in found and name != "reading" else np.nan
        told = "" if np.isnan(ratio) else f"{ratio:.2f}"
        table.add_row(name, f"{np.median(ms):.3f}", told)
    console.print(table)
    for module in IMPORTS:
        if importlib.util.find_spec(module.partition(".")[0]):
            console.print(f"import {module}: {import_s(module):.2f} s of CPU")


if __name__ == "__main__":
    main()
