"""Latents: one netCDF-4 file per embedding, every recording as every network encodes it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ajgdata.store.features import (
    CONVENTIONS,
    Column,
    as_coordinates,
    attributes_of,
    columns_of,
    damage_reported,
    open_netcdf,
    write_netcdf,
)

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
        f"{LATENT}{dimension}": xr.Variable(
            ("fold", "init", "recording", f"dimension_{dimension}"),
            values.astype(np.float32),
            {"long_name": "latent", "units": "1"},
        )
        for dimension, values in sorted(latents.latent.items())
    }
    coordinates = as_coordinates({**latents.columns, VALIDATION_FOLD: fold})
    attrs = {"Conventions": CONVENTIONS, **latents.attrs}
    write_netcdf(path, xr.Dataset(arrays, coordinates, attrs))


def read_latents(path: Path) -> Latents:
    """Return the latents in a file. Raises DataError for a file of another kind."""
    with open_netcdf(path) as dataset, damage_reported(path):
        columns = columns_of(dataset)
        fold = columns.pop(VALIDATION_FOLD).values
        latent = {
            int(str(name).removeprefix(LATENT)): array.values
            for name, array in dataset.data_vars.items()
        }
        return Latents(dict(sorted(latent.items())), fold, columns, attributes_of(dataset))
