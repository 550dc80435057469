"""Acoustic sensing with jamming grippers: recordings in, features, models and a report out.

>>> import ajgdata
>>> features = ajgdata.load_features("size")    # an xarray.Dataset    # doctest: +SKIP
"""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr
    from sklearn.base import BaseEstimator

__version__ = version("ajgdata")
__all__ = ["__version__", "load_features", "load_model"]


def load_features(name: str, project: str | Path | None = None) -> xr.Dataset:
    """Features and labels of the data set `name`, lazily.

    Returns an xarray.Dataset with `feature` (recording, frequency), float32, and every label as a
    coordinate along `recording` (numbers: NaN is missing; text: "" is missing). `recording` is
    `<session>/<recording_id>`; `sha256` is the hash of its file. Use it in a `with` block or call
    `.close()`, since it keeps the file open. `project` is the folder that holds `datasets/`
    (default: AJGDATA_ROOT, else the working directory or the nearest folder above it).

    Raises DataError when the features have not been made, FileNotFoundError outside a project.
    """
    from ajgdata.paths import find_project
    from ajgdata.store.features import open_store

    paths = find_project(None if project is None else Path(project))
    return open_store(paths.features(name))


def load_model(
    name: str, task: str, model: str = "cnn", project: str | Path | None = None
) -> BaseEstimator:
    """The model trained for `task` on all recordings of the data set `name`.

    Returns a fitted scikit-learn estimator that takes features (n, n_features) as `load_features`
    gives them. Raises DataError when it has not been, or could not be, trained.
    """
    from ajgdata.paths import find_project
    from ajgdata.pipeline.train import load_model as load

    paths = find_project(None if project is None else Path(project))
    return load(paths.model(name, task, model))[0]
