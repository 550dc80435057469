"""Simulated sample data in the package, for first steps without a project."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ajgdata.store.features import open_store
from ajgdata.types import DataError

if TYPE_CHECKING:
    import xarray as xr

#: Folder of the samples: one feature file per data set.
SAMPLES = Path(__file__).with_name("samples")


def load_features(name: str) -> xr.Dataset:
    """Return the sample of a data set in the format of `ajgdata.load_features`.

    Returns an xarray.Dataset with `feature` (recording, frequency), float32, and labels as
    coordinates along `recording`. The sample contains a few simulated grasps per object and
    session. Attributes name the data set and the commit. Needs no project and no download. Raises
    DataError, which lists the samples, for any other name.

    >>> import ajgdata
    >>> with ajgdata.tutorial.load_features("ycb") as features:
    ...     mean = features.feature.groupby("object").mean()
    >>> mean.sizes["object"], features.attrs["source"]
    (16, 'simulated')
    """
    names = sorted(file.stem for file in SAMPLES.glob("*.nc"))
    if name not in names:
        raise DataError("ajgdata.tutorial", f"has no sample {name!r}", f"use {', '.join(names)}")
    # A sample that states no version of its format has version 1.
    return open_store(SAMPLES / f"{name}.nc", unstated=1)
