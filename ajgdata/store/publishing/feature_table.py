"""One Parquet table with the labels and the feature of each recording, from a feature file.

pandas, Polars and DuckDB read it without ajgdata.
"""

from __future__ import annotations

import io
import json
import math

import pyarrow
import pyarrow.parquet

from ajgdata.store.features import FeatureColumn, FeatureRows
from ajgdata.store.labels import MEANINGS
from ajgdata.store.publishing.table import LEADING_COLUMNS, TRAILING_COLUMNS

#: Column of the features.
FEATURE = "feature"


def feature_table_bytes(store: FeatureRows) -> bytes:
    """Return the Parquet table of a feature file: one row per recording, in the order of the file.

    The columns are identifiers, labels by name, `flags`, `sha256` and `feature`, a list of float32
    with the same length in all rows. A missing label is null. The metadata of a column have its
    unit and its meaning, and those of `feature` the frequency of each element, or the
    coordinates of its dimensions. The same feature
    file gives the same bytes.
    """
    labels = sorted(set(store.columns) - {*LEADING_COLUMNS, *TRAILING_COLUMNS})
    order = (*LEADING_COLUMNS, *labels, *TRAILING_COLUMNS)
    names = [name for name in order if name in store.columns]
    arrays = [_values(store.columns[name]) for name in names]
    fields = [
        pyarrow.field(name, array.type, metadata=_metadata(name, store.columns[name]))
        for name, array in zip(names, arrays, strict=True)
    ]
    width = store.flat.shape[1]
    elements = pyarrow.array(store.feature.ravel(), pyarrow.float32())
    feature = pyarrow.FixedSizeListArray.from_arrays(elements, width)
    about_feature = {
        **store.feature_attrs,
        **{key: json.dumps(values) for key, values in store.coordinates.items()},
    }
    fields.append(pyarrow.field(FEATURE, feature.type, metadata=about_feature))
    attrs = {key: str(value) for key, value in store.attrs.items()}
    schema = pyarrow.schema(fields, metadata=attrs)
    buffer = io.BytesIO()
    table = pyarrow.table([*arrays, feature], schema=schema)
    pyarrow.parquet.write_table(table, buffer, use_dictionary=names)
    return buffer.getvalue()


def _values(column: FeatureColumn) -> pyarrow.Array:
    """Return the values (n,) of a column with their type; an empty text and NaN are null."""
    values = column.values.tolist()
    kind = column.values.dtype.kind
    if kind == "U":
        return pyarrow.array([value or None for value in values], pyarrow.string())
    if kind == "f":
        numbers = [None if math.isnan(value) else value for value in values]
        return pyarrow.array(numbers, pyarrow.float64())
    return pyarrow.array(values, pyarrow.int64())


def _metadata(name: str, column: FeatureColumn) -> dict[str, str]:
    """Return the metadata of a column: `units`, `long_name`, and `role` of a target, if known."""
    about = dict(column.attrs)
    if name in MEANINGS:
        about.setdefault("long_name", MEANINGS[name])
    return about
