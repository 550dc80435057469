"""Tables of results come back from their files as they were written."""

import json
import math

import pytest

from ajgdata.store.tables import read_measurements, read_tables, write_measurements, write_tables
from ajgdata.types import DataError
from ajgdata.types.table import Column, Table

READS = "this version of ajgdata reads format 3"
COLUMNS = (Column("label", "Label"), Column("value", "Value", "mm"))
CELLS = [
    ("inf", math.inf),
    ("-inf", -math.inf),
    ("nan", 0.5),
    ("null", None),
    ('{"number": "inf"}', True),
]
ROWS = tuple({"label": label, "value": value} for label, value in CELLS)
TABLE = Table("t", "T", "note", COLUMNS, ROWS)


@pytest.mark.parametrize("several", [False, True])
def test_labels_that_look_like_numbers_stay_labels_and_infinity_stays_a_number(tmp_path, several):
    path = tmp_path / "t.json"
    if several:
        write_measurements(path, [({"model": "knn"}, [TABLE])])
        ((about, tables),) = read_measurements(path)
    else:
        write_tables(path, [TABLE], model="knn")
        about, tables = read_tables(path)
    assert about == {"model": "knn"}
    assert tables == [TABLE]


def test_nan_is_a_missing_value(tmp_path):
    path = tmp_path / "t.json"
    rows = ({"label": "a", "value": math.nan}, {"label": "nan", "value": 1.0})
    write_tables(path, [Table("t", "T", "", COLUMNS, rows)])
    _, (table,) = read_tables(path)
    assert table.column("value") == [None, 1.0]
    assert table.column("label") == ["a", "nan"]
    assert math.isnan(table.numbers("value")[0])


@pytest.mark.parametrize("read", [read_tables, read_measurements])
@pytest.mark.parametrize(
    ("content", "problem"),
    [
        ({"tables": [], "measurements": []}, f"states no format; {READS}"),
        ({"format": 2, "tables": []}, f"format 2 is of an earlier version of ajgdata; {READS}"),
        ({"format": 4, "tables": []}, f"format 4 is of a later version of ajgdata; {READS}"),
        ({"format": 3}, "has no key `"),
    ],
)
def test_a_file_of_another_version_is_refused_by_name(tmp_path, read, content, problem):
    path = tmp_path / "t.json"
    path.write_text(json.dumps(content))
    with pytest.raises(DataError) as refused:
        read(path)
    assert str(refused.value).startswith(f"{path}: {problem}")
    assert str(refused.value).endswith(". Compute it again with this version of ajgdata.")
