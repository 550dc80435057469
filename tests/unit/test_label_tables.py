"""Tables as spreadsheets write them, and several of them joined."""

import pandas as pd
import pytest

from ajgdata.store.label_tables import joined, read_label_table
from ajgdata.types import DataError

ROWS = [{"name": "a", "mass (g)": "1,5", "note": "x, y"}, {"name": "b", "mass (g)": "", "note": ""}]


@pytest.mark.parametrize(
    "text",
    [
        'name,mass (g),note\na,"1,5","x, y"\nb,,\n',
        "name;mass (g);note\na;1,5;x, y\nb;;\n",
        "\ufeffname;mass (g);note\r\na;1,5;x, y\r\n;;\r\nb;;\r\n",
        "name\tmass (g)\tnote\na\t1,5\tx, y\nb\t\t\n",
    ],
    ids=["comma", "semicolon", "excel", "tab"],
)
def test_the_mark_between_cells_is_recognised(tmp_path, text):
    (tmp_path / "t.csv").write_text(text, encoding="utf-8", newline="")
    table = read_label_table(tmp_path / "t.csv")
    assert table.to_dict("records") == ROWS


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a;b\n1;2;3\n", "t.csv: is not a valid table .Expected 2 fields in line 2, saw 3"),
        ("a;a\n1;2\n", "column 'a' occurs twice"),
        ("a;\n1;2\n", "column 2 has no name"),
        ('a;b\n"1;2\n', "not a valid table"),
    ],
)
def test_what_is_wrong_with_one_is_said(tmp_path, text, said):
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(DataError, match=said):
        read_label_table(tmp_path / "t.csv")


def test_tables_are_joined_by_a_key(tmp_path):
    (tmp_path / "stats.csv").write_text("stone;frost;form\nS1;1;z\nS3;0;z\n")
    table = pd.DataFrame(
        {"hit": ["1", "2", "3"], "stone": ["S1", "S1", "S2"], "form": ["flat", "flat", "round"]}
    )
    got, notes = joined(tmp_path, table, {"stats.csv": "stone"})
    assert got.columns.tolist() == ["hit", "stone", "form", "frost"]
    assert got["frost"].tolist() == ["1", "1", ""]
    assert got["form"].tolist() == ["flat", "flat", "round"]  # the first table's stays
    assert notes == [
        "stats.csv: not used, because a table before has it: form",
        "stats.csv has no row for stone S2",
    ]
    with pytest.raises(DataError, match=r"stats.csv: has no column 'hit'; there are \['stone'"):
        joined(tmp_path, table, {"stats.csv": "hit"})
    with pytest.raises(DataError, match="--join: has no column 'frost'"):
        joined(tmp_path, table, {"stats.csv": "frost"})
    (tmp_path / "stats.csv").write_text("stone;frost\nS1;1\nS1;0\n")
    with pytest.raises(DataError, match="stone 'S1' occurs twice"):
        joined(tmp_path, table, {"stats.csv": "stone"})
