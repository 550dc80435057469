"""Publish a data set, and use what was published without this library."""

from pathlib import Path

import xarray as xr

from ajgdata.paths import find_project
from ajgdata.pipeline.publish import publish

done = publish(find_project(), "size", Path("size-1.0.0"))

with xr.open_dataset(done.folder / "features.nc") as features:
    edges_mm = sorted(set(features.edge_mm.values.tolist()))
    unit = features.edge_mm.attrs["units"]
print(f"{done.recordings} recordings of {len(edges_mm)} sizes in {unit}, {done.bytes / 1e6:.1f} MB")
