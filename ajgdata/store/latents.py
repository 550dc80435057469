"""Latents: one netCDF-4 file for an embedding, every recording as every network sees it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ajgdata.store.features import (
    CONVENTIONS,
    DAMAGE,
    Column,
    as_coordinates,
    attributes_of,
    check_room,
    columns_of,
    open_netcdf,
    write_netcdf,
)
from ajgdata.store.files import replacing
from ajgdata.types import DataError

if TYPE_CHECKING:
    import xarray as xr

LATENT, VALIDATION_FOLD = "latent_", "validation_fold"


@dataclass(frozen=True)
class Latents:
    """Latents of n recordings.

    `latent`: by dimension d an array (fold, init, n, d), of which the rows with `validation_fold`
    (n,) k are new to fold k. `columns` are of length n.
    """

    latent: Mapping[int, np.ndarray]
    validation_fold: np.ndarray
    columns: Mapping[str, Column]
    attrs: Mapping[str, str | float | int]


def write_latents(path: Path, latents: Latents) -> None:
    """Write atomically; the same content gives the same bytes."""
    import xarray as xr

    fold = Column(latents.validation_fold.astype(np.int32))
    arrays = {
        f"{LATENT}{dimension}": _variable(values)
        for dimension, values in sorted(latents.latent.items())
    }
    dataset = xr.Dataset(
        arrays,
        as_coordinates({**latents.columns, VALIDATION_FOLD: fold}),
        {"Conventions": CONVENTIONS, **latents.attrs},
    )
    with replacing(path) as temporary:
        check_room(path, dataset.nbytes)
        write_netcdf(temporary, dataset)


def _variable(values: np.ndarray) -> xr.Variable:
    import xarray as xr

    dimensions = ("fold", "init", "recording", f"dimension_{values.shape[-1]}")
    return xr.Variable(dimensions, values.astype(np.float32), {"long_name": "latent", "units": "1"})


def read_latents(path: Path) -> Latents:
    """Return the latents in a file. Raises DataError for any other file."""
    try:
        with open_netcdf(path) as dataset:
            dataset.load()
            columns = columns_of(dataset)
            fold = columns.pop(VALIDATION_FOLD).values
            arrays = {str(name): array.values for name, array in dataset.data_vars.items()}
            attrs = attributes_of(dataset)
    except DAMAGE:
        raise DataError(path, "not a readable file of latents", "delete it, run again") from None
    latent = {
        int(name.removeprefix(LATENT)): values
        for name, values in arrays.items()
        if name.startswith(LATENT)
    }
    return Latents(dict(sorted(latent.items())), fold, columns, attrs)
