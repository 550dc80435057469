"""What the report is given of a store, the odd ones included."""

import numpy as np

from ajgdata.pipeline.dataset_summary import mean_spectra
from ajgdata.store.features import FeatureRows, text_column
from ajgdata.types import DatasetSpec

FEATURE = np.asarray([[1, 3], [3, 5], [9, 9]], np.float32)
SPEC = DatasetSpec.model_validate(
    {"name": "d", "tasks": {"t": {"target": "y"}}, "targets": {"y": {"kind": "classification"}}}
)


def test_mean_of_each_class_without_those_that_have_none():
    store = FeatureRows(FEATURE, np.asarray([0.0, 1.0]), {"y": text_column(["a", "a", ""])}, {})
    spectra = mean_spectra(store, SPEC)
    assert spectra.labels == ("a",)
    np.testing.assert_array_equal(spectra.mean, [[2, 4]])
