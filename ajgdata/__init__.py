"""Acoustic sensing with jamming grippers: from recordings to features, models and a report.

>>> import ajgdata
>>> recordings = ajgdata.load_recordings("size")  # an xarray.Dataset; files are read when used
>>> with ajgdata.load_features("size") as features:  # an xarray.Dataset with the same labels
...     bool((features.edge_mm.values == recordings.edge_mm.values).all())
True
>>> train, test = ajgdata.load_dataset("size").folds("size")[0]  # no grasp is in both parts
>>> train.X.shape, test.X.shape  # (recordings, bins of the spectrum)
((12, 1025), (4, 1025))
"""

from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ajgdata.evaluate.agreement import (
        Estimate,
        Interval,
        compare_with_published,
        placebo_test,
        wilson_interval,
    )
    from ajgdata.evaluate.crossval import cross_validate, estimate_score
    from ajgdata.evaluate.intervals import metric_interval
    from ajgdata.evaluate.splits import grouped_folds, placement_folds, random_folds
    from ajgdata.features.spectrum import frequencies_hz, spectrum
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
    from ajgdata.types import FeatureKind, FeatureSettings

__version__ = version("ajgdata")
__all__ = [
    "Dataset",
    "Estimate",
    "FeatureKind",
    "FeatureSettings",
    "Interval",
    "Part",
    "__version__",
    "compare_with_published",
    "cross_validate",
    "estimate_score",
    "frequencies_hz",
    "grouped_folds",
    "load_dataset",
    "load_features",
    "load_metrics",
    "load_model",
    "load_predictor",
    "load_recordings",
    "metric_interval",
    "placebo_test",
    "placement_folds",
    "random_folds",
    "spectrum",
    "wilson_interval",
]
#: Public names by module. A module is imported when one of its names is first used, so
#: `import ajgdata` does not load pandas or scikit-learn.
_MODULES = {
    "ajgdata.evaluate.agreement": (
        "Estimate",
        "Interval",
        "compare_with_published",
        "placebo_test",
        "wilson_interval",
    ),
    "ajgdata.evaluate.crossval": ("cross_validate", "estimate_score"),
    "ajgdata.evaluate.intervals": ("metric_interval",),
    "ajgdata.evaluate.splits": ("grouped_folds", "placement_folds", "random_folds"),
    "ajgdata.features.spectrum": ("frequencies_hz", "spectrum"),
    "ajgdata.loading": (
        "Dataset",
        "Part",
        "load_dataset",
        "load_features",
        "load_metrics",
        "load_model",
        "load_predictor",
        "load_recordings",
    ),
    "ajgdata.types": ("FeatureKind", "FeatureSettings"),
}


def __dir__() -> list[str]:
    """Return the names for tab completion; no module is imported."""
    return sorted({*globals(), *__all__, "tutorial"})


def __getattr__(name: str) -> Any:
    """Return a public name from its module, or the module `ajgdata.tutorial`."""
    if name == "tutorial":
        return import_module("ajgdata.tutorial")
    for module, names in _MODULES.items():
        if name in names:
            return getattr(import_module(module), name)
    raise AttributeError(f"module 'ajgdata' has no attribute {name!r}")
