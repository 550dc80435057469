"""Latents: one netCDF-4 file for an embedding, every recording as every network sees it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import h5netcdf
import h5py
import numpy as np

from ajgdata.store.features import (
    CONVENTIONS,
    DAMAGE,
    Column,
    axes_of,
    plain,
    read_column,
    write_column,
)
from ajgdata.store.hdf5 import check_texts, writing
from ajgdata.types import DataError

LATENT, UNSEEN = "latent_", "unseen_"
VALIDATION_FOLD, UNSEEN_FOLD = "validation_fold", "unseen_fold_of"


@dataclass(frozen=True)
class Latents:
    """Latents of n recordings.

    `latent`: by dimension d an array (fold, init, n, d), of which the rows with `validation_fold`
    (n,) k are new to fold k. `unseen` (fold, init, n, d) likewise with `unseen_fold` (n,): those
    rows are of things that the fold never saw; None, and folds of -1, if nobody asked. `columns`
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
    folds = {VALIDATION_FOLD: latents.validation_fold, UNSEEN_FOLD: latents.unseen_fold}
    with writing(path) as store:
        store.attrs.update({"Conventions": CONVENTIONS, **latents.attrs})
        store.dimensions["recording"] = len(latents.validation_fold)
        for name, column in sorted(latents.columns.items()):
            write_column(store, name, column)
        for name, fold in folds.items():
            write_column(store, name, Column(fold.astype(np.int32)))
        coordinates = " ".join(sorted({*latents.columns, *folds} - {"recording"}))
        for dimension, values in sorted(latents.latent.items()):
            _write(store, f"{LATENT}{dimension}", "fold", values, coordinates)
        if latents.unseen is not None:
            name = f"{UNSEEN}{latents.unseen.shape[-1]}"
            _write(store, name, "unseen_fold", latents.unseen, coordinates)


def _write(
    store: h5netcdf.File, name: str, fold: str, values: np.ndarray, coordinates: str
) -> None:
    dimensions = (fold, "init", "recording", f"dimension_{values.shape[-1]}")
    for dimension, length in zip(dimensions, values.shape, strict=True):
        if dimension not in store.dimensions:
            store.dimensions[dimension] = length
    checked = {"chunks": (1, 1, *values.shape[2:]), "fletcher32": True} if values.size else {}
    variable = store.create_variable(name, dimensions, data=values.astype(np.float32), **checked)
    variable.attrs.update({"long_name": "latent", "units": "1", "coordinates": coordinates})


def read_latents(path: Path) -> Latents:
    """Return the latents in a file. Raises DataError for a file that is none."""
    try:
        with h5py.File(path, "r") as store:
            check_texts(store)
            columns = {
                name: read_column(variable)
                for name, variable in store.items()
                if name == "recording" or axes_of(variable)[:1] == ["recording"]
            }
            latent = {
                int(name.removeprefix(LATENT)): store[name][...]
                for name in store
                if name.startswith(LATENT)
            }
            unseen = [store[name][...] for name in store if _is_unseen(name)]
            attrs = {k: plain(v) for k, v in store.attrs.items() if not k.startswith("_")}
        folds = [columns.pop(name).values for name in (VALIDATION_FOLD, UNSEEN_FOLD)]
    except DAMAGE:
        raise DataError(path, "not a readable file of latents", "delete it, run again") from None
    latent = dict(sorted(latent.items()))
    return Latents(latent, folds[0], unseen[0] if unseen else None, folds[1], columns, attrs)


def _is_unseen(name: str) -> bool:
    return name.startswith(UNSEEN) and name.removeprefix(UNSEEN).isdigit()
