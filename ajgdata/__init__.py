"""Acoustic sensing with jamming grippers: recordings in, features, models and a report out.

>>> import ajgdata
>>> features = ajgdata.load_features("size")  # an xarray.Dataset  # doctest: +SKIP
>>> recordings = ajgdata.load_recordings("size")  # lazily, the same labels  # doctest: +SKIP
>>> train, test = ajgdata.load_dataset("size").split("size", fold=0)  # doctest: +SKIP
"""

from importlib.metadata import version

from ajgdata.loading import (
    Dataset,
    Part,
    load_dataset,
    load_features,
    load_model,
    load_recordings,
)

__version__ = version("ajgdata")
__all__ = [
    "Dataset",
    "Part",
    "__version__",
    "load_dataset",
    "load_features",
    "load_model",
    "load_recordings",
]
