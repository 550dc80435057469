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

LATENT, UNSEEN = "latent_", "unseen_"
VALIDATION_FOLD, UNSEEN_FOLD = "validation_fold", "unseen_fold_of"


@dataclass(frozen=True)
class Latents:
    """Latents of n recordings.

    `latent`: by dimension d an array (fold, init, n, d), of which the rows with `validation_fold`
    (n,) k are new to fold k. `unseen` (fold, init, n, d) likewise with `unseen_fold` (n,): those
    rows are of objects that the fold never saw; None, and folds of -1, if nobody asked. `columns`
    are of length n.
    """

    latent: Mapping[int, np.ndarray]
    validation_fold: np.ndarray
    unseen: np.ndarray | None
    unseen_fold: np.ndarray
    columns: Mapping[str, Column]
    attrs: Mapping[str, str | float | int]


def write_latents(path: Path, latents: Latents) -> None:
    """Write atomically; the same content gives the same bytes."""
    import xarray as xr

    folds = {VALIDATION_FOLD: latents.validation_fold, UNSEEN_FOLD: latents.unseen_fold}
    columns = {name: Column(fold.astype(np.int32)) for name, fold in folds.items()}
    arrays = {
        f"{LATENT}{dimension}": _variable("fold", values)
        for dimension, values in sorted(latents.latent.items())
    }
    if latents.unseen is not None:
        arrays[f"{UNSEEN}{latents.unseen.shape[-1]}"] = _variable("unseen_fold", latents.unseen)
    dataset = xr.Dataset(
        arrays,
        as_coordinates({**latents.columns, **columns}),
        {"Conventions": CONVENTIONS, **latents.attrs},
    )
    with replacing(path) as temporary:
        check_room(path, dataset.nbytes)
        write_netcdf(temporary, dataset)


def _variable(fold: str, values: np.ndarray) -> xr.Variable:
    import xarray as xr

    dimensions = (fold, "init", "recording", f"dimension_{values.shape[-1]}")
    return xr.Variable(dimensions, values.astype(np.float32), {"long_name": "latent", "units": "1"})


def read_latents(path: Path) -> Latents:
    """Return the latents in a file. Raises DataError for any other file."""
    try:
        with open_netcdf(path) as dataset:
            dataset.load()
            columns = columns_of(dataset)
            folds = [columns.pop(name).values for name in (VALIDATION_FOLD, UNSEEN_FOLD)]
            arrays = {str(name): array.values for name, array in dataset.data_vars.items()}
            attrs = attributes_of(dataset)
    except DAMAGE:
        raise DataError(path, "not a readable file of latents", "delete it, run again") from None
    latent = {
        int(name.removeprefix(LATENT)): values
        for name, values in arrays.items()
        if name.startswith(LATENT)
    }
    unseen = [values for name, values in arrays.items() if name.startswith(UNSEEN)]
    latent = dict(sorted(latent.items()))
    return Latents(latent, folds[0], unseen[0] if unseen else None, folds[1], columns, attrs)
