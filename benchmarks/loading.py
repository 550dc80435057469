"""How long it takes to load features, as a ratio to numpy.load of the same array.

    python benchmarks/loading.py [--rows 640 --rows 50000] [--shards 500]

Each store is made of random spectra with the labels of a data set. Process CPU time, the minimum of
several turns, in each of which everything is measured once, so that a busy machine slows all alike.
Files are in the system's cache: it is reading, not the disk, that is measured. `open_mfdataset` is
shown opening shards of the same rows that the merged store holds.
"""

import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
import xarray as xr
from rich.console import Console
from rich.table import Table

import ajgdata
from ajgdata.paths import Paths
from ajgdata.store.features import Column, Shard, read_store, text_column, write_store

BINS = 1025
ATTRS = {"long_name": "spectrum", "units": "1"}


def made(rows: int, start: int = 0) -> Shard:
    """Rows of a store with as many label columns as a simulated data set has."""
    generator = np.random.default_rng(start)
    feature = generator.random((rows, BINS), np.float32)
    names = [f"virtual-{n // 500:02d}/virtual_cube_{n:06d}" for n in range(start, start + rows)]
    texts = ("session_id", "grasp_id", "object", "quality", "source", "gripper", "medium", "flags")
    columns = {name: text_column([f"{name}_{n % 16}" for n in range(rows)]) for name in texts}
    columns |= {
        "recording": text_column(names),
        "sha256": text_column([f"{n:064x}" for n in range(start, start + rows)]),
        "sample": Column(np.zeros(rows, np.int32)),
        "edge_mm": Column(generator.random(rows), {"units": "mm"}),
    }
    return Shard(feature, np.arange(BINS) * 44_100 / 2048, columns, {"settings": "{}"})


def loaded(project: Path, name: str) -> None:
    """The features with every label, as people load them."""
    with ajgdata.load_features(name, project) as features:
        assert features.load().feature.shape[1] == BINS


def by_xarray(path: Path) -> None:
    """The same by xarray's own reader."""
    with xr.open_dataset(path) as features:
        assert features.load().feature.shape[1] == BINS


def fastest(calls: dict[str, Callable[[], object]], turns: int) -> dict[str, float]:
    """Shortest CPU time in s of each call, taken in turn."""
    times = {name: float("inf") for name in calls}
    for _ in range(turns):
        for name, call in calls.items():
            start = time.process_time()
            call()
            times[name] = min(times[name], time.process_time() - start)
    return times


def main(
    rows: Annotated[list[int], typer.Option(help="rows of a store")] = [640, 50_000],  # noqa: B006
    shards: Annotated[int, typer.Option(help="shards for open_mfdataset")] = 100,
    turns: Annotated[int, typer.Option(help="times that everything is measured")] = 7,
) -> None:
    """Print times in ms and ratios."""
    table = Table("rows", "what", "CPU, ms", "of np.load")
    with tempfile.TemporaryDirectory() as temporary:
        root = Path(temporary)
        paths = Paths(root)
        paths.datasets.mkdir()
        for count in rows:
            name, array = f"r{count}", root / f"{count}.npy"
            shard = made(count)
            np.save(array, shard.feature)
            write_store(paths.features(name), shard, ATTRS)
            calls = {
                "np.load": lambda array=array: np.load(array),
                "load_features": lambda name=name: loaded(root, name),
                "xarray.open_dataset": lambda name=name: by_xarray(paths.features(name)),
                "read_store": lambda name=name: read_store(paths.features(name)),
            }
            times = fastest(calls, turns)
            for what, took in times.items():
                ratio = f"{took / times['np.load']:.1f}"
                table.add_row(str(count), what, f"{1e3 * took:.1f}", ratio)
        opened = opening(paths, shards)
        for what, took in opened.items():
            table.add_row(f"{2 * shards}", what, f"{1e3 * took:.1f}", "")
    Console().print(table)


def opening(paths: Paths, shards: int) -> dict[str, float]:
    """Time in s to open two rows a shard: merged into one file, and file by file."""
    files = [paths.shard("many", f"s{n}") for n in range(shards)]
    for number, file in enumerate(files):
        write_store(file, made(2, 2 * number), ATTRS)
    write_store(paths.features("merged"), made(2 * shards), ATTRS)

    def one_by_one() -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            parts = [xr.open_dataset(file, engine="h5netcdf", chunks=None) for file in files]
            xr.concat(parts, "recording").close()
            for part in parts:
                part.close()

    calls = {
        "open the merged store": lambda: ajgdata.load_features("merged", paths.root).close(),
        f"open and join {shards} shards": one_by_one,
    }
    return fastest(calls, 1)


if __name__ == "__main__":
    typer.run(main)
