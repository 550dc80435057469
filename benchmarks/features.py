"""Measure the time of reading a recording and computing its feature, for several libraries.

Run `python benchmarks/features.py` (librosa: `make .venv/.bench`). The recordings are
synthetic: noisy sweeps through random resonances, with a fixed seed. All routes must give the same
features. Further tables measure the kinds of features, and the job `features` of the workflow.
`--before CHECKOUT` compares this checkout with another one: the time of both, and the bytes of all
spectra. Repeats are interleaved, so other processes on the computer influence all routes equally.
"""

from __future__ import annotations

import argparse
import functools
import importlib.util
import itertools
import multiprocessing
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from time import perf_counter, process_time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import scipy.signal
import soundfile as sf
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from ajgdata.features.compute import FeatureComputer
from ajgdata.features.spectrum import spectrum
from ajgdata.paths import Paths
from ajgdata.pipeline.machine import machine_line
from ajgdata.store.audio import file_sha256, read_audio
from ajgdata.store.features import open_store
from ajgdata.store.sessions import write_session
from ajgdata.types import AudioSettings, FeatureKind, FeatureSettings, Recording, Session
from ajgdata.types.features import MelSettings, SpectrogramSettings, TransferFunctionSettings

RATE_HZ = 44_100
SETTINGS = FeatureSettings()
WINDOW = SETTINGS.window
HOP = SETTINGS.hop
AUDIO = AudioSettings()
#: Programs of other checkouts import the package from there.
HERE = Path(__file__).resolve().parents[1]
Route = Callable[[Sequence[Path]], NDArray[np.floating]]
#: Program that runs the job `features` of a data set without Snakemake, and prints its CPU time and
#: its wall time in seconds.
JOB = """
import sys, time
from pathlib import Path
from ajgdata.paths import Paths
from ajgdata.pipeline.feature_file import build_feature_file
from ajgdata.types import AudioSettings, FeatureSettings
paths = Paths(Path(sys.argv[1]))
files = {"store": paths.features("d"), "quarantine": paths.quarantine("d")}
files["hashes"] = paths.session_hashes("d")
for file in files.values():
    file.unlink(missing_ok=True)
settings = {"audio": AudioSettings(), "features": FeatureSettings(), "targets": {}}
start = time.perf_counter()
cpu_start = time.process_time()
build_feature_file(paths, dataset="d", sessions=["s"], code="", threads=int(sys.argv[2]),
                   **settings, **files)
print(time.process_time() - cpu_start)
print(time.perf_counter() - start)
"""
#: Program that computes the spectra of files five times, and prints the smallest CPU time in s
#: and a hash of the spectra. Other programs can only slow down a pass.
SPECTRA = """
import hashlib, sys, time
from pathlib import Path
from ajgdata.features.spectrum import spectrum
from ajgdata.store.audio import read_audio
from ajgdata.types import AudioSettings, FeatureSettings
audio, settings = AudioSettings(), FeatureSettings()
files = sorted(Path(sys.argv[1]).glob("*.wav"))
seconds = []
for _ in range(5):
    start = time.process_time()
    spectra = [spectrum(read_audio(file, audio).samples, audio.sample_rate_hz, settings)
               for file in files]
    seconds.append(time.process_time() - start)
print(min(seconds))
print(hashlib.sha256(b"".join(values.tobytes() for values in spectra)).hexdigest())
"""
#: Settings of the compared kinds of features by title.
KINDS: dict[str, FeatureKind] = {
    "spectrum": SETTINGS,
    "spectrogram": SpectrogramSettings(),
    "mel": MelSettings(),
    "mel, frames": MelSettings(over_time="frames"),
    "transfer_function": TransferFunctionSettings(),
}


def by_ajgdata(paths: Sequence[Path]) -> NDArray[np.floating]:
    """Return the features (recordings, bins) as the workflow computes them."""
    if not paths:
        return np.empty((0, 0))
    features = [spectrum(read_audio(path, AUDIO).samples, RATE_HZ, SETTINGS) for path in paths]
    return np.stack(features)


def by_two_threads(paths: Sequence[Path]) -> NDArray[np.floating]:
    """Return the features; each thread computes one half."""
    half = len(paths) // 2
    with ThreadPoolExecutor(2) as pool:
        return np.concatenate(list(pool.map(by_ajgdata, (paths[:half], paths[half:]))))


@functools.cache
def processes() -> ProcessPoolExecutor:
    """Return two processes that have already started."""
    pool = ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn"))
    list(pool.map(by_ajgdata, [[], []]))
    return pool


def by_two_processes(paths: Sequence[Path]) -> NDArray[np.floating]:
    """Return the features; each process computes one half."""
    half = len(paths) // 2
    return np.concatenate(list(processes().map(by_ajgdata, (paths[:half], paths[half:]))))


def by_scipy_stft(paths: Sequence[Path]) -> NDArray[np.floating]:
    """Return the features with `scipy.signal.stft`."""
    rows = []
    for path in paths:
        samples, _ = sf.read(path)
        _, _, transform = scipy.signal.stft(
            samples, nperseg=WINDOW, noverlap=WINDOW - HOP, boundary=None, padded=False
        )
        rows.append(normalised(transform, axis=1))
    return np.stack(rows)


def by_short_time_fft(paths: Sequence[Path]) -> NDArray[np.floating]:
    """Return the features with `scipy.signal.ShortTimeFFT`."""
    window = scipy.signal.get_window("hann", WINDOW)
    transformer = scipy.signal.ShortTimeFFT(window, HOP, RATE_HZ)
    rows = []
    for path in paths:
        samples, _ = sf.read(path)
        first = WINDOW // 2 // HOP
        last = (len(samples) - WINDOW // 2) // HOP + 1
        rows.append(normalised(transformer.stft(samples, p0=first, p1=last), axis=1))
    return np.stack(rows)


def by_librosa(paths: Sequence[Path]) -> NDArray[np.floating]:
    """Return the features with librosa."""
    import librosa

    rows = []
    for path in paths:
        samples, _ = librosa.load(path, sr=None)
        transform = librosa.stft(samples, n_fft=WINDOW, hop_length=HOP, center=False)
        rows.append(normalised(transform, axis=1))
    return np.stack(rows)


def normalised(transform: NDArray[np.complexfloating], axis: int) -> NDArray[np.floating]:
    """Return the sum of magnitudes along the time axis, divided by the sum over all bins."""
    summed = np.abs(transform).sum(axis=axis)
    return summed / summed.sum()


def routes() -> dict[str, Route]:
    """Return the functions of all installed libraries by name."""
    available: dict[str, Route] = {
        "ajgdata, 1 thread": by_ajgdata,
        "ajgdata, 2 threads": by_two_threads,
        "ajgdata, 2 processes": by_two_processes,
    }
    if importlib.util.find_spec("librosa"):
        available["librosa.load + librosa.stft"] = by_librosa
    available["soundfile + scipy.signal.stft"] = by_scipy_stft
    available["soundfile + scipy ShortTimeFFT"] = by_short_time_fft
    return available


def make_recordings(folder: Path, count: int, subtype: str) -> list[Path]:
    """Write one-second recordings: noisy sweeps, each through four random resonances."""
    rng = np.random.default_rng(0)
    time_s = np.arange(RATE_HZ) / RATE_HZ
    sweep = scipy.signal.chirp(time_s, 20, 1, 20_000, method="logarithmic")
    paths = []
    for number in range(count):
        centres = 2 * np.pi * np.exp(rng.uniform(np.log(200), np.log(15_000), 4)) / RATE_HZ
        poles = rng.uniform(0.95, 0.995, 4) * np.exp(1j * centres)
        sound = scipy.signal.lfilter([1], np.real(np.poly([*poles, *poles.conj()])), sweep)
        sound = 0.5 * sound / np.abs(sound).max() + 1e-3 * rng.standard_normal(RATE_HZ)
        paths.append(folder / f"{number}_{subtype}.wav")
        sf.write(paths[-1], sound, RATE_HZ, subtype=subtype)
    return paths


def check_agreement(paths: Sequence[Path]) -> float:
    """Return the largest difference between routes, relative to the largest bin of a recording.

    The limit of 1e-5 allows for the rounding of float32.
    """
    expected = by_scipy_stft(paths)
    worst = 0.0
    for name, route in routes().items():
        difference = float((np.abs(route(paths) - expected) / expected.max(axis=1)[:, None]).max())
        assert difference < 1e-5, f"{name} differs by {difference:.1e}"
        worst = max(worst, difference)
    return worst


def timed(paths: Sequence[Path], repeats: int) -> dict[str, NDArray[np.floating]]:
    """Return the wall times (repeats,) of each route in seconds, from interleaved runs."""
    functions = routes()
    seconds = {name: np.empty(repeats) for name in functions}
    for repeat in range(repeats):
        for name, route in functions.items():
            start = perf_counter()
            route(paths)
            seconds[name][repeat] = perf_counter() - start
    return seconds


def compare(console: Console, paths: Sequence[Path], title: str, repeats: int) -> None:
    """Print the median time of each route, and its ratios to the routes of ajgdata.

    A ratio is the median of the ratios within each repeat.
    """
    seconds = timed(paths, repeats)
    table = Table(title=f"{title}: {len(paths)} recordings of one second, {repeats} repeats")
    table.add_column("route", no_wrap=True)
    table.add_column("ms per recording", justify="right")
    references = [name for name in seconds if name.startswith("ajgdata")]
    for name in references:
        table.add_column(f"/ {name}", justify="right")
    for name, values in seconds.items():
        ratios = [np.median(values / seconds[reference]) for reference in references]
        each_ms = 1e3 * np.median(values) / len(paths)
        table.add_row(name, f"{each_ms:.2f}", *(f"{ratio:.2f}" for ratio in ratios))
    console.print(table)


def growth(console: Console, paths: Sequence[Path]) -> None:
    """Print the time of ajgdata for different numbers of recordings."""
    table = Table(title="ajgdata, 1 thread, by number of recordings")
    for heading in ("recordings", "seconds", "ms per recording"):
        table.add_column(heading, justify="right")
    for count in (100, 300, 1000):
        repeated = list(itertools.islice(itertools.cycle(paths), count))
        start = perf_counter()
        by_ajgdata(repeated)
        seconds = perf_counter() - start
        table.add_row(str(count), f"{seconds:.2f}", f"{1e3 * seconds / count:.2f}")
    console.print(table)


def write_dataset(root: Path, files: Sequence[Path]) -> None:
    """Write a data set `d` with one session, which refers to the files in their folder."""
    rows = [
        Recording(
            recording_id=file.stem,
            file=file.name,
            sha256=file_sha256(file),
            grasp_id=file.stem,
            sample=1,
            object="box",
        )
        for file in files
    ]
    session = Session(session_id="s", source="import", audio_root=str(files[0].parent))
    write_session(Paths(root).session("d", "s"), session, rows)


def feature_files(console: Console, folder: Path, count: int, repeats: int) -> None:
    """Print the time of the job `features` with one process and with two, and compare the files."""
    folder.mkdir()
    files = make_recordings(folder, count, "PCM_24")
    table = Table(title=f"job `features`, recordings of one second, {repeats} repeats")
    for heading in ("recordings", "1 process, s", "2 processes, s", "ratio"):
        table.add_column(heading, justify="right")
    for number in (count // 4, count):
        root = folder / f"project of {number}"
        write_dataset(root, files[:number])
        seconds = np.empty((repeats, 2))
        contents = set()
        for repeat, column in itertools.product(range(repeats), range(2)):
            command = [sys.executable, "-c", JOB, str(root), str(column + 1)]
            done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
            seconds[repeat, column] = float(done.stdout.splitlines()[-1])
            contents.add(Paths(root).features("d").read_bytes())
        assert len(contents) == 1, "the number of processes changes the feature file"
        alone, shared = np.median(seconds, axis=0)
        ratio = np.median(seconds[:, 0] / seconds[:, 1])
        table.add_row(f"{number:,}", f"{alone:.2f}", f"{shared:.2f}", f"{ratio:.2f}")
    console.print(table)


def output_of(program: str, checkout: Path, *arguments: str) -> list[str]:
    """Return the lines that a Python program prints with the package of a checkout."""
    command = [sys.executable, "-c", program, *arguments]
    environment = {**os.environ, "PYTHONPATH": str(checkout)}
    done = subprocess.run(
        command, check=True, stdout=subprocess.PIPE, text=True, env=environment, cwd=checkout
    )
    return done.stdout.splitlines()


def before_and_after(
    console: Console, folder: Path, before: Path, count: int, repeats: int
) -> None:
    """Print the times of another checkout and of this one, and compare the bytes of spectra.

    The stored values of the job `features` are compared, because its file also names the settings.
    """
    folder.mkdir()
    files = make_recordings(folder, count, "PCM_24")
    checkouts = {"before": before, "after": HERE}
    seconds: dict[str, list[dict[str, float]]] = {"spectra": [], "job `features`": []}
    spectra = set()
    stored = set()
    root = folder / "project"
    write_dataset(root, files)
    for repeat in range(repeats):
        names = list(checkouts)[:: 1 if repeat % 2 else -1]
        spectra_s = {}
        job_s = {}
        for name in names:
            spent, digest = output_of(SPECTRA, checkouts[name], str(folder))
            spectra_s[name] = float(spent)
            spectra.add(digest)
            job_s[name] = float(output_of(JOB, checkouts[name], str(root), "1")[-2])
            with open_store(Paths(root).features("d")) as store:
                stored.add(store["feature"].values.tobytes())
        seconds["spectra"].append(spectra_s)
        seconds["job `features`"].append(job_s)
    assert len(spectra) == 1, "spectra have other bytes"
    assert len(stored) == 1, "the job stores other values"
    table = Table(
        title=f"{count} recordings of one second, {repeats} repeats, CPU time; equal bytes"
    )
    for heading in ("", "before, ms", "after, ms", "after / before"):
        table.add_column(heading, justify="right")
    for name, rows in seconds.items():
        before_ms, after_ms = (
            1e3 * float(np.median([row[key] for row in rows])) / count for key in checkouts
        )
        ratio = float(np.median([row["after"] / row["before"] for row in rows]))
        table.add_row(name, f"{before_ms:.3f}", f"{after_ms:.3f}", f"{ratio:.3f}")
    console.print(table)


def kinds(console: Console, paths: Sequence[Path], repeats: int) -> None:
    """Print the CPU time of each kind of feature, for one microphone and for two."""
    samples = [read_audio(path, AUDIO).samples for path in paths]
    played = samples[0]
    computers = {
        (title, microphone): FeatureComputer(AudioSettings(microphone=microphone), settings)
        for title, settings in KINDS.items()
        for microphone in (1, (1, 2))
    }
    seconds = np.empty((repeats, len(computers)))
    values = {}
    for repeat in range(repeats):
        for column, (key, computer) in enumerate(computers.items()):
            channels = 1 if key[1] == 1 else 2
            values[key] = computer(np.tile(samples[0], (channels, 1)), played).values.size
            start = process_time()
            for sound in samples:
                computer(np.tile(sound, (channels, 1)), played)
            seconds[repeat, column] = process_time() - start
    table = Table(title=f"kinds of features: {len(paths)} recordings, {repeats} repeats, CPU time")
    headings = ("kind", "microphones", "values", "ms per recording", "/ spectrum")
    for heading in headings:
        table.add_column(heading, justify="right")
    for column, (title, microphone) in enumerate(computers):
        each_ms = 1e3 * float(np.median(seconds[:, column])) / len(paths)
        ratio = float(np.median(seconds[:, column] / seconds[:, 0]))
        channels = "1" if microphone == 1 else "2"
        count = f"{values[title, microphone]:,}"
        table.add_row(title, channels, count, f"{each_ms:.2f}", f"{ratio:.2f}")
    console.print(table)


def main() -> None:
    """Measure all routes and the job, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-n", "--recordings", type=int, default=300)
    parser.add_argument("--job", type=int, default=4000, help="recordings of the job, 0: none")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--before", type=Path, help="checkout to compare with, for its tables only")
    arguments = parser.parse_args()
    console = Console(width=110)
    console.print(
        f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}: "
        "other programs can slow down two threads or processes"
    )
    with tempfile.TemporaryDirectory() as folder:
        if arguments.before:
            before = arguments.before.resolve()
            before_and_after(
                console, Path(folder) / "both", before, arguments.recordings, arguments.repeats
            )
            return
        for subtype in ("PCM_24", "PCM_16"):
            paths = make_recordings(Path(folder), arguments.recordings, subtype)
            worst = check_agreement(paths[:10])
            console.print(f"{subtype}: all routes agree within {worst:.1e} of the largest bin")
            compare(console, paths, subtype, arguments.repeats)
        growth(console, paths)
        kinds(console, paths[:100], arguments.repeats)
        if arguments.job:
            feature_files(console, Path(folder) / "job", arguments.job, arguments.repeats)
    console.print(machine_line())


if __name__ == "__main__":
    main()
