"""Feature files: netCDF-4 files of spectra and labels, read and written by xarray.

A shard is the file of one session; the file of a data set joins its shards with the labels. Text is
stored as fixed-length characters, which compress well and which every netCDF reader understands.
"""

from __future__ import annotations

import errno
import json
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ajgdata.store.files import replacing
from ajgdata.types import DataError

if TYPE_CHECKING:
    import xarray as xr

CHUNK_ROWS = 128
#: Spectra that are read at once where a file need not be in memory: 17 MB of 1025 bins.
BLOCK_ROWS = 4096
CONVENTIONS = "CF-1.11"
#: What h5netcdf and xarray raise for files that are damaged or of another kind.
DAMAGE = (OSError, LookupError, ValueError, RuntimeError, TypeError, AttributeError)
_FREQUENCY = {"units": "Hz", "standard_name": "sound_frequency", "long_name": "frequency"}
_COMPRESSED = {"zlib": True, "complevel": 4, "shuffle": True}
_LONG_NAMES = {"stft": "spectrum", "transfer_function": "size of the transfer function"}


@dataclass(frozen=True)
class Column:
    """One labelled column: text, int or float values and their attributes."""

    values: np.ndarray
    attrs: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Shard:
    """Rows of a feature file: `feature` (n, f) float32, `frequency_hz` (f,), columns (n,).

    Where only the labels were read, `feature` is (n, 0).
    """

    feature: np.ndarray
    frequency_hz: np.ndarray
    columns: Mapping[str, Column]
    attrs: Mapping[str, str | float | int]


def text_column(values: Sequence[str], **attrs: str) -> Column:
    """Return a column of text; the empty string is a missing value. Raises ValueError for text that
    holds NUL, which ends a text in netCDF."""
    if any("\0" in value for value in values):
        raise ValueError("a text holds a NUL character")
    return Column(np.asarray(values, dtype=np.str_), attrs)


def feature_attrs(attrs: Mapping[str, Any]) -> dict[str, str]:
    """Return the attributes of `feature` in a file whose attributes hold the settings."""
    kind = json.loads(str(attrs["settings"]))["features"].get("kind", "stft")
    return {"long_name": _LONG_NAMES[kind], "units": "1"}


def settings_text(settings: Mapping[str, Any]) -> str:
    """Return the settings as one JSON attribute."""
    return json.dumps(settings, sort_keys=True)


def write_store(path: Path, shard: Shard, feature_attrs: Mapping[str, str]) -> None:
    """Write `shard` atomically; the same content gives the same bytes.

    Raises ValueError for a spectrum that is not finite and for columns of another length.
    """
    import xarray as xr

    if not np.isfinite(shard.feature).all():
        raise ValueError(f"{path}: a feature is NaN or infinite; no file is written")
    spectra = shard.feature.astype(np.float32, copy=False)
    dataset = xr.Dataset(
        {"feature": (("recording", "frequency"), spectra, dict(feature_attrs))},
        {"frequency": ("frequency", shard.frequency_hz, _FREQUENCY)}
        | as_coordinates(shard.columns),
        {"Conventions": CONVENTIONS, **shard.attrs},
    )
    with replacing(path) as temporary:
        check_room(path, spectra.nbytes)
        write_netcdf(temporary, dataset)


def as_coordinates(columns: Mapping[str, Column]) -> dict[str, xr.Variable]:
    """Return columns (n,) as coordinates along `recording`, in the order of their names."""
    import xarray as xr

    return {
        name: xr.Variable("recording", column.values, dict(column.attrs))
        for name, column in sorted(columns.items())
    }


def write_netcdf(path: Path, dataset: xr.Dataset) -> None:
    """Write a file whose chunks have checksums: text compressed, numbers as they are, because gzip
    saves a quarter of the spectra, and reading takes five times as long."""
    encoding: dict[str, dict[str, Any]] = {}
    for name, variable in dataset.variables.items():
        if not variable.size:
            continue  # HDF5 stores neither characters nor checksums of nothing
        is_text = variable.dtype.kind == "U"
        stored = {"dtype": "S1", **_COMPRESSED} if is_text else {"_FillValue": None}
        encoding[str(name)] = {**stored, "fletcher32": True}
        if name == "feature":
            encoding[str(name)]["chunksizes"] = (min(CHUNK_ROWS, len(variable)), variable.shape[1])
    dataset.to_netcdf(path, engine="h5netcdf", encoding=encoding)


def check_room(path: Path, size: int) -> None:
    """Raise OSError if the disk has less than `size` bytes left: HDF5 crashes on a full disk."""
    if shutil.disk_usage(path.parent).free < size:
        raise OSError(errno.ENOSPC, "No space left on device", str(path))


def open_store(path: Path) -> xr.Dataset:
    """Return a feature file: `feature` (recording, frequency), which is read when it is used, and
    the labels as coordinates. Close it after use. Raises DataError for any other file."""
    if not path.is_file():
        raise DataError(path, "does not exist yet", f"run `ajgdata run {path.stem}` first")
    try:
        dataset = open_netcdf(path)
        if dataset["feature"].dims != ("recording", "frequency"):
            raise ValueError("the dimensions are not those of spectra")
    except DAMAGE:
        raise _damaged(path) from None
    return dataset


def open_netcdf(path: Path) -> xr.Dataset:
    """Return a netCDF file with its coordinates in memory and its arrays not read yet. Raises one
    of `DAMAGE`."""
    import xarray as xr

    how: dict[str, Any] = {"mask_and_scale": False, "decode_times": False, "phony_dims": "access"}
    file = xr.open_dataset(path, engine="h5netcdf", **how)
    try:
        texts = {
            name: (array.dims, np.asarray(array.values, np.str_), array.attrs)
            for name, array in file.coords.items()
            if array.dtype.kind == "O"
        }
        dataset = file.assign_coords(texts)
        for array in dataset.coords.values():
            array.load()
    except DAMAGE:
        file.close()
        raise
    dataset.set_close(file.close)
    return dataset


def columns_of(dataset: xr.Dataset) -> dict[str, Column]:
    """Return the coordinates (n,) along `recording`, in the order of their names."""
    return {
        str(name): Column(array.values, {key: str(one) for key, one in array.attrs.items()})
        for name, array in sorted(dataset.coords.items(), key=lambda item: str(item[0]))
        if array.dims == ("recording",)
    }


def attributes_of(dataset: xr.Dataset) -> dict[str, str | float | int]:
    """Return the attributes of a file as texts and numbers."""
    return {
        name: value.item() if isinstance(value, np.generic) else value
        for name, value in dataset.attrs.items()
    }


def read_store(path: Path) -> Shard:
    """Return a whole feature file in memory. Raises DataError for any other file.

    >>> from ajgdata.paths import find_project
    >>> from ajgdata.store.features import read_store
    >>> shard = read_store(find_project().features("size"))
    >>> shard.feature.shape, shard.frequency_hz[:2]  # (recordings, bins), Hz
    ((16, 1025), array([ 0.        , 21.53320312]))
    >>> shard.columns["edge_mm"].attrs["units"]
    'mm'
    """
    with open_store(path) as dataset:
        return replace(labels_of(dataset), feature=read_spectra(path, dataset))


def read_labels(path: Path) -> Shard:
    """Return a feature file without its spectra: `feature` is (n, 0). Raises DataError for any
    other file."""
    with open_store(path) as dataset:
        return labels_of(dataset)


def spectra_blocks(path: Path) -> Iterator[np.ndarray]:
    """Yield the spectra of a feature file in their order, BLOCK_ROWS (m, f) at a time. Raises
    DataError for any other file."""
    with open_store(path) as dataset:
        for start in range(0, dataset.sizes["recording"], BLOCK_ROWS):
            yield read_spectra(path, dataset, slice(start, start + BLOCK_ROWS))


def labels_of(dataset: xr.Dataset) -> Shard:
    """Return an open feature file without its spectra: `feature` is (n, 0)."""
    nothing = np.empty((dataset.sizes["recording"], 0), np.float32)
    frequency_hz = dataset["frequency"].values
    return Shard(nothing, frequency_hz, columns_of(dataset), attributes_of(dataset))


def read_spectra(path: Path, dataset: xr.Dataset, rows: slice = slice(None)) -> np.ndarray:
    """Return rows (m, f) of the open feature file `path`. Raises DataError for damaged ones."""
    try:
        return dataset["feature"][rows].values
    except OSError:
        raise _damaged(path) from None


def _damaged(path: Path) -> DataError:
    return DataError(path, "not a readable feature store", "delete it and run again")


def concatenate(shards: Sequence[Shard]) -> Shard:
    """Return shards of one data set, one after the other.

    Raises ValueError when bins, settings or columns differ, or when a recording stands in two
    shards.
    """
    first = shards[0]
    for shard in shards[1:]:
        if not np.array_equal(shard.frequency_hz, first.frequency_hz):
            raise ValueError("shards differ in their frequencies: were their settings the same?")
        if shard.attrs.get("settings") != first.attrs.get("settings"):
            raise ValueError("shards differ in their settings")
        if set(shard.columns) != set(first.columns):
            raise ValueError("shards differ in their columns")
    columns = {
        name: Column(np.concatenate([s.columns[name].values for s in shards]), column.attrs)
        for name, column in first.columns.items()
    }
    names, counts = np.unique(columns["recording"].values, return_counts=True)
    if (counts > 1).any():
        raise ValueError(f"recording {str(names[counts > 1][0])!r} stands in two shards")
    feature = np.concatenate([shard.feature for shard in shards])
    return Shard(feature, first.frequency_hz, columns, first.attrs)
