"""Feature stores: netCDF-4 files of spectra with labels, written whole or not at all.

A shard holds one session; the store of a data set is its shards joined with the labels. Text is
stored as fixed-length characters, which compress and which every netCDF reader understands.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5netcdf
import h5py
import numpy as np

from ajgdata.store.hdf5 import check_texts, writing
from ajgdata.types import DataError

CHUNK_ROWS = 128
#: Spectra that are read at once where a store need not be in memory: 17 MB of 1025 bins.
BLOCK_ROWS = 4096
#: Keeps h5netcdf from choosing chunks larger than an array without rows.
_NO_CHUNKS = {"chunking_heuristic": "h5py"}
CONVENTIONS = "CF-1.11"
#: A store may claim so many times the bytes of its file, plus `SMALL_BYTES`. Spectra are not
#: compressed and are most of a store, so that real ones claim about what they have.
MAX_GROWTH, SMALL_BYTES = 100, 2**26
#: What h5py raises for files that are damaged, or that are not ours.
DAMAGE = (OSError, LookupError, ValueError, RuntimeError, TypeError, AttributeError)


_LONG_NAMES = {
    "stft": "spectrum",
    "sweep_tracking": "spectrum where the sweep is",
    "transfer_function": "size of the transfer function",
}


@dataclass(frozen=True)
class Column:
    """One labelled column of a store: text, int or float values and their attributes."""

    values: np.ndarray
    attrs: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Shard:
    """Rows of a store: `feature` (n, f) float32, `frequency_hz` (f,), columns of length n."""

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
    """Return the attributes of `feature` in a store whose attributes hold the settings."""
    kind = json.loads(str(attrs["settings"]))["features"].get("kind", "stft")
    return {"long_name": _LONG_NAMES[kind], "units": "1"}


def write_store(path: Path, shard: Shard, feature_attrs: Mapping[str, str]) -> None:
    """Write `shard` atomically. Raises ValueError for anything that is not finite or not aligned.

    The same content gives the same bytes: HDF5 keeps no times, and no clock is asked.
    """
    write_blocks(path, shard, [shard.feature], feature_attrs)


def write_blocks(
    path: Path, labels: Shard, blocks: Iterable[np.ndarray], feature_attrs: Mapping[str, str]
) -> None:
    """Write what `write_store` does, with the spectra of `blocks`, each (m, f), one after another,
    in place of those of `labels`: one block is held at a time."""
    rows, bins = len(labels.feature), len(labels.frequency_hz)
    with writing(path) as store:
        store.attrs.update({"Conventions": CONVENTIONS, **labels.attrs})
        store.dimensions = {"recording": rows, "frequency": bins}
        axis = store.create_variable(
            "frequency", ("frequency",), data=labels.frequency_hz, chunks=(bins,), fletcher32=True
        )
        axis.attrs.update(
            {"units": "Hz", "standard_name": "sound_frequency", "long_name": "frequency"}
        )
        for name, column in sorted(labels.columns.items()):
            if len(column.values) != rows:
                raise ValueError(f"{path}: column {name} has {len(column.values)} of {rows} rows")
            write_column(store, name, column)
        feature = store.create_variable(
            "feature",
            ("recording", "frequency"),
            "f4",
            **_checked_chunks(min(CHUNK_ROWS, rows), bins),
        )
        coordinates = " ".join(sorted(c for c in labels.columns if c != "recording"))
        feature.attrs.update({**feature_attrs, "coordinates": coordinates})
        done = 0
        for spectra in _by_chunks(path, blocks, bins):
            if done + len(spectra) <= rows:  # else it is told below
                feature[done : done + len(spectra)] = spectra
            done += len(spectra)
        if done != rows:
            raise ValueError(f"{path}: {done} spectra for {rows} rows")


def _by_chunks(path: Path, blocks: Iterable[np.ndarray], bins: int) -> Iterator[np.ndarray]:
    """Yield the rows of `blocks` in pieces that end where the chunks of a store do, so that each
    chunk is written once. Raises ValueError for spectra that are not finite or of another width."""
    left = np.empty((0, bins), np.float32)
    for block in blocks:
        if block.shape[1:] != (bins,):
            raise ValueError(f"{path}: {block.shape[1]} bins but ({bins},) frequencies")
        if not np.isfinite(block).all():
            raise ValueError(f"{path}: a feature is NaN or infinite; no store is written")
        whole = block.astype(np.float32, copy=False)
        whole = np.concatenate([left, whole]) if len(left) else whole
        end = len(whole) - len(whole) % CHUNK_ROWS
        if end:
            yield whole[:end]
        left = whole[end:]
    if len(left):
        yield left


def _checked_chunks(rows: int, width: int) -> dict[str, Any]:
    """Return chunks with a checksum; HDF5 takes neither for an array without rows.

    Spectra are not compressed: gzip saves a quarter of the file, and reading it takes five times
    as long.
    """
    return {"chunks": (rows, width), "fletcher32": True} if rows else _NO_CHUNKS


def _compressed(rows: int, width: int) -> dict[str, Any]:
    """Return chunks and compression, which has a checksum of its own."""
    if not rows:
        return _NO_CHUNKS
    packed = {"compression": "gzip", "compression_opts": 4, "shuffle": True}
    return {"chunks": (rows, width), **packed}


def write_column(store: h5netcdf.File, name: str, column: Column) -> None:
    """Write a column along `recording`, a dimension of `store` that is there already."""
    values = column.values
    if values.dtype.kind != "U":
        chunks = {"chunks": values.shape, "fletcher32": True} if len(values) else _NO_CHUNKS
        variable = store.create_variable(name, ("recording",), data=values, **chunks)
    else:
        encoded = np.char.encode(values, "utf-8") if len(values) else np.empty(0, "S1")
        width = max(1, encoded.dtype.itemsize)
        dimension = f"string{width}"
        if dimension not in store.dimensions:
            store.dimensions[dimension] = width
        characters = encoded.astype(f"S{width}").view("S1").reshape(len(values), width)
        variable = store.create_variable(
            name, ("recording", dimension), "S1", **_compressed(len(values), width)
        )
        if len(values):
            variable[...] = characters
        variable.attrs["_Encoding"] = "utf-8"
    variable.attrs.update(column.attrs)


def read_store(path: Path) -> Shard:
    """Return a whole store in memory. Raises DataError for a file that is none.

    >>> from ajgdata.paths import find_project
    >>> from ajgdata.store.features import read_store
    >>> shard = read_store(find_project().features("size"))
    >>> shard.feature.shape, shard.frequency_hz[:2]  # (recordings, bins), Hz
    ((16, 1025), array([ 0.        , 21.53320312]))
    >>> shard.columns["edge_mm"].attrs["units"]
    'mm'
    """
    with reading(path) as store:
        spectra, frequency, columns, attrs = contents(store)
        feature = spectra[...]
    return Shard(feature, frequency.values, columns, attrs)


def read_labels(path: Path) -> Shard:
    """Return a store as `read_store` does, but for the spectra: in their place, `feature` (n, 1)
    holds the number of each row. Raises DataError for a file that is none."""
    with reading(path) as store:
        spectra, frequency, columns, attrs = contents(store)
        rows = np.arange(len(spectra))[:, np.newaxis]
    return Shard(rows, frequency.values, columns, attrs)


def read_spectra(path: Path, rows: np.ndarray) -> np.ndarray:
    """Return the spectra (m, f) of the rows of that number, rising, of a store."""
    with reading(path) as store:
        spectra = _variables(store)["feature"][...]
    return spectra if len(rows) == len(spectra) else spectra[rows]


def spectra_blocks(path: Path) -> Iterator[np.ndarray]:
    """Yield the spectra of a store in their order, BLOCK_ROWS (m, f) at a time. Raises DataError
    for a file that is none."""
    with reading(path) as store:
        spectra = _variables(store)["feature"]
        for start in range(0, len(spectra), BLOCK_ROWS):
            yield spectra[start : start + BLOCK_ROWS]


@contextmanager
def reading(path: Path) -> Iterator[h5py.File]:
    """Yield a store, which is closed at the end. Raises DataError for what is none."""
    _check_made(path)
    try:
        with h5py.File(path, "r") as store:
            check_texts(store)
            yield store
    except DAMAGE:
        raise DataError(path, "not a readable feature store", "delete it and run again") from None


def contents(
    store: h5py.File,
) -> tuple[h5py.Dataset, Column, dict[str, Column], dict[str, str | float | int]]:
    """Return the spectra, which are not read yet, and what else a store holds: frequencies (with
    their attributes), columns, attributes. Raises one of `DAMAGE`."""
    variables = _variables(store)
    attrs = {k: plain(v) for k, v in store.attrs.items() if not k.startswith("_")}
    spectra = variables.pop("feature")
    columns = {
        name: read_column(variable)
        for name, variable in variables.items()
        if name == "recording"
        or (variable.shape[:1] == spectra.shape[:1] and "DIMENSION_LIST" in variable.attrs)
    }
    return spectra, read_column(variables["frequency"]), columns, attrs


def _variables(store: h5py.File) -> dict[str, h5py.Dataset]:
    """Return the arrays of a store, which may come from anywhere: raises ValueError for what lies
    in another file, and for sizes that are only claimed."""
    variables = {}
    for name in store:
        variable = store[name] if isinstance(store.get(name, getlink=True), h5py.HardLink) else None
        if not isinstance(variable, h5py.Dataset) or variable.is_virtual or variable.external:
            raise ValueError(f"{name} lies elsewhere")
        if variable.dtype.kind not in "Sif":
            raise ValueError(f"{name} holds neither text nor numbers")
        variables[name] = variable
    claimed = sum(array.size * array.dtype.itemsize for array in variables.values())
    if claimed > MAX_GROWTH * store.id.get_filesize() + SMALL_BYTES:
        raise ValueError("claims to be larger than it can be")
    return variables


def _check_made(path: Path) -> None:
    if not path.is_file():
        raise DataError(path, "this feature store has not been made", "run `snakemake` first")


def axes_of(variable: h5py.Dataset) -> list[str]:
    """Return names of a variable's dimensions; none for a variable that is itself a dimension."""
    if "DIMENSION_LIST" not in variable.attrs:
        return []
    owner = variable.file
    return [owner[refs[0]].name.rsplit("/", 1)[-1] for refs in variable.attrs["DIMENSION_LIST"]]


def read_column(variable: h5py.Dataset) -> Column:
    """Return a column that `write_column` wrote."""
    values = variable[...]
    if values.dtype.kind == "S":
        values = _texts(values)
    return Column(values, attrs_of(variable))


def attrs_of(variable: h5py.Dataset) -> dict[str, str]:
    """Return attributes of an array, without those that only HDF5 and netCDF need."""
    internal = ("_", "DIMENSION", "REFERENCE", "CLASS", "NAME", "coordinates")
    named = [name for name in variable.attrs if not name.startswith(internal)]
    return {name: str(plain(variable.attrs[name])) for name in named}


def _texts(characters: np.ndarray) -> np.ndarray:
    """Return texts (n,) of UTF-8 characters (n, width)."""
    rows, width = characters.shape
    if not rows:
        return np.empty(0, "U1")
    codes = np.ascontiguousarray(characters).view(np.uint8)
    if codes.max() < 128:  # ASCII is its own code points: far faster than decoding row by row
        return codes.astype(np.uint32).view(f"U{width}")[:, 0]
    return np.char.decode(codes.view(f"S{width}")[:, 0], "utf-8")


def plain(value: Any) -> str | float | int:
    """Return an attribute as HDF5 gives it, as text or a number."""
    if isinstance(value, bytes):
        return value.decode()
    if isinstance(value, np.ndarray):
        value = value.ravel()[0]
    return value.item() if isinstance(value, np.generic) else value


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
    return Shard(
        np.concatenate([s.feature for s in shards]), first.frequency_hz, columns, first.attrs
    )


def settings_text(settings: Mapping[str, Any]) -> str:
    """Return the settings as one JSON attribute."""
    return json.dumps(settings, sort_keys=True)
