"""Latents of all recordings by every run of an embedding, as netCDF-4."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.types import DataError


class Run(NamedTuple):
    """One run: `recording` (n,), `latent` (n, d), and the fold (n,) that did not train on each."""

    recording: NDArray[np.str_]
    latent: NDArray[np.float32]
    validation_fold: NDArray[np.integer]


def read_run(path: Path, dimension: int, fold: int, init: int) -> Run:
    """One run's latents of one dimension. Raises DataError."""
    import xarray as xr

    if not path.is_file():
        raise DataError(path, "these latents have not been made", "run `snakemake` first")
    with xr.open_dataset(path, engine="h5netcdf") as store:
        name = f"latent_{dimension}"
        if name not in store:
            held = sorted(str(key) for key in store.data_vars)
            raise DataError(path, f"has no {name}, but {held}", "delete it and run again")
        return Run(
            store["recording"].values.astype(str),
            store[name].sel(fold=fold, init=init).values,
            store["validation_fold"].values,
        )
