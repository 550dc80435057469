"""What the report is given of a store, the odd ones included."""

import numpy as np

from ajgdata.pipeline.dataset_summary import mean_spectra
from ajgdata.store.features import Shard, text_column
from ajgdata.types import DatasetSpec

SPEC = {"name": "d", "tasks": {"t": {"target": "y"}}}
FEATURE = np.asarray([[1, 3], [3, 5], [9, 9]], np.float32)


def spectra(kind, column, rows=3):
    spec = DatasetSpec.model_validate(SPEC | {"targets": {"y": {"kind": kind}}})
    columns = {} if column is None else {"y": column}
    store = Shard(FEATURE[:rows], np.asarray([0.0, 1.0]), columns, {})
    blocks = (FEATURE[row : row + 1] for row in range(rows))
    return mean_spectra(store, spec, blocks)


def test_mean_of_each_class_without_those_that_have_none():
    made = spectra("classification", text_column(["a", "a", ""]))
    assert made.labels == ("a",)
    np.testing.assert_array_equal(made.mean, [[2, 4]])
