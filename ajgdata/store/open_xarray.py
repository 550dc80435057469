"""Feature stores as xarray.Datasets, of which only the spectra that are asked for are read.

xarray's own reader opens them as well, and takes four times as long: it looks at every array and
attribute again and again.
"""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Any

import h5py
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from ajgdata.store.features import attrs_of, contents, reading


class Spectra(BackendArray):
    """The array of a file, float32 (recording, frequency); `opened` keeps the file open."""

    def __init__(self, array: h5py.Dataset, opened: ExitStack) -> None:
        self.array, self.shape, self.dtype, self.opened = array, array.shape, array.dtype, opened

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        """Return the values that `key` picks."""
        if not self.array:
            raise ValueError("the store is closed: use it in its `with` block, or .load() it there")
        support = indexing.IndexingSupport.OUTER_1VECTOR
        return indexing.explicit_indexing_adapter(key, self.shape, support, self.array.__getitem__)


def open_store(path: Path) -> xr.Dataset:
    """Return a store as a lazy xarray.Dataset: `feature` (recording, frequency) with labels as
    coordinates. Use it in a `with` block, or call `.load()` and `.close()`. Raises DataError.
    """
    with ExitStack() as stack:
        array, frequency, columns, attrs = contents(stack.enter_context(reading(path)))
        opened = stack.pop_all()
    lazy = indexing.LazilyIndexedArray(Spectra(array, opened))
    feature = xr.Variable(("recording", "frequency"), lazy, attrs_of(array))
    coordinates = {
        name: ("recording", column.values, dict(column.attrs)) for name, column in columns.items()
    }
    axis = {"frequency": ("frequency", frequency.values, dict(frequency.attrs))}
    dataset = xr.Dataset({"feature": feature}, axis | coordinates, attrs)
    dataset.set_close(opened.close)
    return dataset
