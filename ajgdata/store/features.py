"""netCDF-4 files of spectra and of latents, with labels. xarray reads and writes them.

Text is stored as characters of fixed length: they compress well, and all netCDF readers understand
them.
"""

from __future__ import annotations

import errno
import json
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ajgdata.paths import command_for
from ajgdata.store.feature_array import COLUMN, FREQUENCY, Axis
from ajgdata.store.files import replacing
from ajgdata.types import DataError, NotPossibleError
from ajgdata.types.formats import FEATURES_FORMAT, FORMAT_KEY, LATENTS_FORMAT, FormatError

if TYPE_CHECKING:
    import xarray as xr

#: Rows of a chunk, which is read and checked as a whole.
CHUNK_ROWS = 128
CONVENTIONS = "CF-1.11"
#: Beginning of the names of arrays of latents, before their dimension; name of the column of folds.
LATENT = "latent_"
VALIDATION_FOLD = "validation_fold"
_UNREADABLE = "is not a readable netCDF file"
_RECOMPUTE = "delete it and run again"
_LOCKED = "is locked by another program, or its file system has no locks (NFS)"
_UNLOCK = "close the other program; without locks, set HDF5_USE_FILE_LOCKING=FALSE"
#: Most bytes of a chunk, for features of many values.
_CHUNK_BYTES = 2**23
#: Beginning of the name of a dimension in a file that has a label of the same name.
_NOT_A_LABEL = "feature_"
_COMPRESSED = {"zlib": True, "complevel": 4, "shuffle": True}


@dataclass(frozen=True)
class FeatureColumn:
    """One labelled column: text, int or float values and their attributes."""

    values: np.ndarray
    attrs: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class FeatureRows:
    """Rows of a feature file: features and columns of n recordings.

    - `feature`: (n, ...) float32, with one dimension for each of `axes`
    - `columns`: labels (n,) by name
    - `kind`: kind of the feature, see `types.features`
    """

    feature: np.ndarray
    axes: tuple[Axis, ...]
    columns: Mapping[str, FeatureColumn]
    attrs: Mapping[str, str | float | int]
    kind: str = "spectrum"

    @property
    def settings(self) -> dict[str, Any]:
        """The settings that the features were computed with: `audio` and `features`."""
        settings: dict[str, Any] = json.loads(str(self.attrs["settings"]))
        return settings

    @property
    def flat(self) -> np.ndarray:
        """The features as (n, f), in the order of the dimensions."""
        return self.feature.reshape(len(self.feature), -1)

    @property
    def frequency_hz(self) -> np.ndarray:
        """The frequencies (f,) of the bins. Raises NotPossibleError for a feature without them."""
        for axis in self.axes:
            if axis.name == FREQUENCY:
                return axis.values
        raise NotPossibleError(f"the feature {self.kind} has no frequencies")

    @property
    def feature_attrs(self) -> dict[str, str]:
        """The meaning and the unit of the features; columns of a table can have different units."""
        if [axis.name for axis in self.axes] == [COLUMN]:
            return {"long_name": self.kind}
        return {"long_name": self.kind, "units": "1"}

    @property
    def has_bins_only(self) -> bool:
        """Whether frequency is the only dimension of a feature."""
        return [axis.name for axis in self.axes] == [FREQUENCY]

    @property
    def coordinates(self) -> dict[str, Any]:
        """The meaning of the values of `flat`, for JSON.

        This is `frequency_hz` for the spectra of one microphone. For other features it is
        `dimensions`, with the coordinates by name; the last dimension varies fastest.
        """
        if self.has_bins_only:
            return {"frequency_hz": self.frequency_hz.tolist()}
        return {"dimensions": {axis.name: axis.values.tolist() for axis in self.axes}}


def text_column(values: Sequence[str], **attrs: str) -> FeatureColumn:
    """Return a column of text; the empty string is a missing value.

    Raises ValueError for text with NUL, which ends a text in netCDF.
    """
    if any("\0" in value for value in values):
        raise ValueError("a text holds a NUL character")
    return FeatureColumn(np.asarray(values, dtype=np.str_), attrs)


def write_store(path: Path, table: FeatureRows) -> None:
    """Write `table` atomically; the same content gives the same bytes.

    Raises ValueError for a feature that is not finite and for columns of another length.
    """
    import xarray as xr

    if not np.isfinite(table.feature).all():
        raise ValueError(f"{path}: a feature is NaN or infinite; no file is written")
    attrs = table.feature_attrs
    features = table.feature.astype(np.float32, copy=False)
    axes = {_stored_name(axis, table): axis for axis in table.axes}
    dataset = xr.Dataset(
        {"feature": (("recording", *axes), features, attrs)},
        {
            **{name: (name, axis.values, dict(axis.attrs)) for name, axis in axes.items()},
            **as_coordinates(table.columns),
        },
        {"Conventions": CONVENTIONS, FORMAT_KEY: FEATURES_FORMAT.version, **table.attrs},
    )
    write_netcdf(path, dataset)


def _stored_name(axis: Axis, table: FeatureRows) -> str:
    """Return the name of an axis in a file. A label can have the name of an axis, e.g. `time`."""
    return f"{_NOT_A_LABEL}{axis.name}" if axis.name in table.columns else axis.name


def as_coordinates(columns: Mapping[str, FeatureColumn]) -> dict[str, xr.Variable]:
    """Return columns (n,) as coordinates along `recording`, in the order of their names."""
    import xarray as xr

    return {
        name: xr.Variable("recording", column.values, dict(column.attrs))
        for name, column in sorted(columns.items())
    }


def write_netcdf(path: Path, dataset: xr.Dataset) -> None:
    """Write a file atomically, with a checksum per chunk.

    Text is compressed, and numbers are not: gzip would reduce the size of spectra by a quarter, but
    reading would take five times as long.
    """
    encoding: dict[str, dict[str, Any]] = {}
    for name, variable in dataset.variables.items():
        if not variable.size:
            continue  # HDF5 stores neither characters nor checksums of an empty variable
        if variable.dtype.kind == "U":
            stored: dict[str, Any] = {"dtype": "S1", **_COMPRESSED}
        else:
            stored = {"_FillValue": None}
        stored["fletcher32"] = True
        if name == "feature":
            row_bytes = variable.nbytes // len(variable)
            rows = min(CHUNK_ROWS, len(variable), max(1, _CHUNK_BYTES // row_bytes))
            stored["chunksizes"] = (rows, *variable.shape[1:])
        encoding[str(name)] = stored
    with replacing(path) as temporary:
        if shutil.disk_usage(path.parent).free < dataset.nbytes:  # HDF5 crashes on a full disk
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        dataset.to_netcdf(temporary, engine="h5netcdf", encoding=encoding)


def open_store(path: Path, *, unstated: int | None = None) -> xr.Dataset:
    """Return a feature file: `feature` (recording, ...), with labels as coordinates.

    The dimensions of a spectrum are (recording, frequency).

    The file reads `feature` when it is used; close it after use. `unstated` is the version of a
    file that states no version; by default, this is an error. Raises DataError for a file that is
    not a feature file, and FormatError for a feature file of another version.
    """
    if not path.is_file():
        raise DataError(path, "does not exist yet", f"run `ajgdata run {path.stem}` first")
    dataset = open_netcdf(path)
    try:
        FEATURES_FORMAT.check(path, _version(dataset, unstated), command_for(path))
    except FormatError:
        dataset.close()
        raise
    return dataset


def _version(dataset: xr.Dataset, unstated: int | None = None) -> Any:
    """Return the version that a file states as a Python value; `unstated` if it states none."""
    version = dataset.attrs.get(FORMAT_KEY, unstated)
    return version.item() if isinstance(version, np.generic) else version


@contextmanager
def damage_reported(path: Path) -> Iterator[None]:
    """Raise DataError for a file that is damaged, locked or of another kind.

    A PermissionError gets the path, because HDF5 does not set it.
    """
    try:
        yield
    except PermissionError:
        raise PermissionError(errno.EACCES, "Permission denied", str(path)) from None
    except OSError as error:
        if "unable to lock file" in str(error):
            raise DataError(path, _LOCKED, _UNLOCK) from None
        raise DataError(path, _UNREADABLE, _RECOMPUTE) from None
    except (LookupError, ValueError, TypeError, AttributeError, RuntimeError):
        raise DataError(path, _UNREADABLE, _RECOMPUTE) from None


def open_netcdf(path: Path) -> xr.Dataset:
    """Return a netCDF file with its coordinates in memory; its arrays are read when they are used.

    Raises DataError for a file that is damaged or of another kind.
    """
    import xarray as xr

    options: dict[str, Any] = {"mask_and_scale": False, "decode_times": False}
    with damage_reported(path):
        file = xr.open_dataset(path, engine="h5netcdf", **options)
        texts = {
            name: (array.dims, np.asarray(array.values, np.str_), array.attrs)
            for name, array in file.coords.items()
            if array.dtype.kind == "O"
        }
        dataset = file.assign_coords(texts)
        for array in dataset.coords.values():
            array.load()
    dataset.set_close(file.close)
    return dataset


def columns_of(dataset: xr.Dataset) -> dict[str, FeatureColumn]:
    """Return the coordinates (n,) along `recording`, in the order of their names."""
    return {
        str(name): FeatureColumn(
            array.values, {key: str(text) for key, text in array.attrs.items()}
        )
        for name, array in sorted(dataset.coords.items(), key=lambda item: str(item[0]))
        if array.dims == ("recording",)
    }


def attributes_of(dataset: xr.Dataset) -> dict[str, str | float | int]:
    """Return the attributes of a file, without the version of its format, as texts and numbers."""
    return {
        name: value.item() if isinstance(value, np.generic) else value
        for name, value in dataset.attrs.items()
        if name != FORMAT_KEY
    }


def read_store(path: Path, *, unstated: int | None = None) -> FeatureRows:
    """Return a whole feature file in memory. Raises DataError as `open_store` does.

    >>> from ajgdata.paths import find_project
    >>> from ajgdata.store.features import read_store
    >>> table = read_store(find_project().features("size"))
    >>> table.feature.shape, table.frequency_hz[:2]  # (recordings, bins), Hz
    ((16, 1025), array([ 0.        , 21.53320312]))
    >>> table.columns["edge_mm"].attrs["units"]
    'mm'
    """
    with open_store(path, unstated=unstated) as dataset, damage_reported(path):
        feature = dataset["feature"]
        return FeatureRows(
            feature.values,
            tuple(_axis(dataset[name]) for name in feature.dims[1:]),
            columns_of(dataset),
            attributes_of(dataset),
            str(feature.attrs["long_name"]),
        )


def _axis(coordinates: xr.DataArray) -> Axis:
    """Return the axis with the coordinates (length,) of a file."""
    name = str(coordinates.name).removeprefix(_NOT_A_LABEL)
    attrs = {str(key): str(text) for key, text in coordinates.attrs.items()}
    return Axis(name, coordinates.values, attrs)


@dataclass(frozen=True)
class Latents:
    """Latents of n recordings.

    `latent` has an array (fold, init, n, d) for each dimension d. The encoder of fold k was not
    trained on the recordings whose `validation_fold` (n,) is k. `columns` are (n,).
    """

    latent: Mapping[int, np.ndarray]
    validation_fold: np.ndarray
    columns: Mapping[str, FeatureColumn]
    attrs: Mapping[str, str | float | int]


def write_latents(path: Path, latents: Latents) -> None:
    """Write latents atomically; the same content gives the same bytes."""
    import xarray as xr

    fold = FeatureColumn(latents.validation_fold.astype(np.int32))
    arrays = {
        f"{LATENT}{dimension}": xr.Variable(
            ("fold", "init", "recording", f"dimension_{dimension}"),
            values.astype(np.float32),
            {"long_name": "latent", "units": "1"},
        )
        for dimension, values in sorted(latents.latent.items())
    }
    coordinates = as_coordinates({**latents.columns, VALIDATION_FOLD: fold})
    attrs = {"Conventions": CONVENTIONS, FORMAT_KEY: LATENTS_FORMAT.version, **latents.attrs}
    write_netcdf(path, xr.Dataset(arrays, coordinates, attrs))


def read_latents(path: Path) -> Latents:
    """Return the latents in a file.

    Raises DataError for a file of another kind, and FormatError for latents of another version.
    """
    with open_netcdf(path) as dataset, damage_reported(path):
        LATENTS_FORMAT.check(path, _version(dataset), command_for(path))
        columns = columns_of(dataset)
        fold = columns.pop(VALIDATION_FOLD).values
        latent = {
            int(str(name).removeprefix(LATENT)): array.values
            for name, array in dataset.data_vars.items()
        }
        return Latents(dict(sorted(latent.items())), fold, columns, attributes_of(dataset))
