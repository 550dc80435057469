"""The job `sample`: write a small part of a simulated feature file, to bundle with the package."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pandas as pd

from ajgdata.store.features import read_store, write_store
from ajgdata.store.labels import take_rows
from ajgdata.types import DataError


def write_sample(store: Path, sample: Path, grasps: int) -> None:
    """Write the first `grasps` grasps of each object in each session of a feature file.

    Raises DataError if the recordings are not simulated.
    """
    features = read_store(store)
    if features.attrs.get("source") != "simulated":
        raise DataError(store, "is not simulated", "bundle simulated recordings only")
    columns = ("session_id", "object", "grasp_id")
    table = pd.DataFrame({name: features.columns[name].values for name in columns})
    first = table.drop_duplicates().groupby(["session_id", "object"]).head(grasps)
    part = take_rows(features, table["grasp_id"].isin(first["grasp_id"]).to_numpy())
    about = f"Simulated sample of {features.attrs['data_set']}: part of its recordings"
    write_store(sample, dataclasses.replace(part, attrs={**features.attrs, "title": about}))
