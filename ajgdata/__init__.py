"""Acoustic sensing with jamming grippers: recordings in, features, models and a report out.

>>> import ajgdata
>>> recordings = ajgdata.load_recordings("size")  # an xarray.Dataset, lazily
>>> with ajgdata.load_features("size") as features:  # another, with the same labels
...     bool((features.edge_mm.values == recordings.edge_mm.values).all())
True
>>> train, test = ajgdata.load_dataset("size").folds("size")[0]  # no grasp is in both
>>> train.X.shape, test.X.shape  # (recordings, bins of the spectrum)
((12, 1025), (4, 1025))
"""

from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ajgdata.loading import (
        Dataset,
        Part,
        load_dataset,
        load_features,
        load_metrics,
        load_model,
        load_predictor,
        load_recordings,
    )

__version__ = version("ajgdata")
__all__ = [
    "Dataset",
    "Part",
    "__version__",
    "load_dataset",
    "load_features",
    "load_metrics",
    "load_model",
    "load_predictor",
    "load_recordings",
]


def __dir__() -> list[str]:
    """Return the names for tab completion, without an import of their modules."""
    return sorted({*globals(), *__all__, "tutorial"})


def __getattr__(name: str) -> Any:
    """Import `ajgdata.loading` or `ajgdata.tutorial` when a name of it is first used."""
    if name == "tutorial":
        return import_module("ajgdata.tutorial")
    if name not in __all__:
        raise AttributeError(f"module 'ajgdata' has no attribute {name!r}")
    return getattr(import_module("ajgdata.loading"), name)
