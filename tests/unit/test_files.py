"""Atomic replacement, and readers that answer bad input with one line."""

import pytest

from ajgdata.store.files import (
    csv_bytes,
    line_of,
    numbered_rows,
    plain_text,
    read_csv,
    read_yaml,
    replacing,
    write_bytes,
)
from ajgdata.types import DataError


def one_line(caught) -> str:
    text = str(caught.value)
    assert "\n" not in text
    return text


def test_a_failing_writer_leaves_the_old_file_and_nothing_else(tmp_path):
    target = tmp_path / "target"
    target.write_bytes(b"old")
    with pytest.raises(RuntimeError), replacing(target) as temporary:
        temporary.write_bytes(b"half of the n")
        raise RuntimeError
    assert [p.name for p in tmp_path.iterdir()] == ["target"]
    assert target.read_bytes() == b"old"


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"a: 1\nb: [\n", ":3: not valid YAML"),
        (b"a: 1\nb: 2\na: 3\n", ":3: not valid YAML (key 'a' stands twice)"),
        (b"a: !!python/object/apply:os.system [x]\n", "not valid YAML (could not determine"),
        (b"- 1\n- 2\n", "holds no keys"),
        pytest.param(b"a: " + b"[" * 100_000, "(maximum recursion depth exceeded", id="deep"),
        (b"a: caf\xe9\n", "not UTF-8 text at byte 6. Save it as UTF-8"),
    ],
)
def test_yaml_that_cannot_be_read(tmp_path, content, said):
    path = tmp_path / "x.yaml"
    path.write_bytes(content)
    with pytest.raises(DataError) as caught:
        read_yaml(path)
    assert one_line(caught).startswith(str(path))
    assert said in str(caught.value)


def test_a_yaml_mapping_that_is_changed_is_read_unchanged(tmp_path):
    path = tmp_path / "x.yaml"
    path.write_text("a: [1, {b: 2}]\n")
    content = read_yaml(path)
    content["a"][1]["b"] = 3
    assert read_yaml(path) == {"a": [1, {"b": 2}]}
    path.write_text("a: [4]\n")
    assert read_yaml(path) == {"a": [4]}


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("a,c\n1,2\n", "needs b; its header is ['a', 'c']"),
        ("a;b\n1;2\n", "with commas between the cells"),
        ("a,b,a\n1,2,3\n", "needs one name per column"),
        ("a,b\n1,2\n1,2,3\n", ":3: 3 cells, the header has 2. Quote cells"),
        ('a,b\n1,"2\n3,4\n', "not valid CSV (unexpected end of data). Correct the quotes"),
    ],
)
def test_csv_that_cannot_be_read(tmp_path, content, said):
    path = tmp_path / "x.csv"
    path.write_text(content)
    with pytest.raises(DataError) as caught:
        read_csv(path, required=("a", "b"))
    assert one_line(caught).startswith(str(path))
    assert said in str(caught.value)


def test_csv_as_spreadsheets_write_it(tmp_path):
    path = tmp_path / "x.csv"
    path.write_bytes('\ufeffa , b\r\n 1 ,"x, ""y"""\r\n\r\n,\r\n2,\r\n'.encode())
    header, rows = read_csv(path)
    assert header == ["a", "b"]
    assert rows == [{"a": "1", "b": 'x, "y"'}, {"a": "2", "b": ""}]
    assert [line for line, _ in numbered_rows(path)[1]] == [2, 5]  # as the spreadsheet counts
    write_bytes(path, csv_bytes(header, rows))
    assert read_csv(path) == (header, rows)


PLACES = """\
# a comment
name: x
objects:
  - {name: a, shape: {kind: cube,
       edge_mm: 3}}
  - name: b
    shape: ball
"""


@pytest.mark.parametrize(
    ("place", "line"),
    [
        (("name",), 2),
        (("nowhere",), 1),
        (("objects", 0, "shape", "cube", "edge_mm"), 5),  # the alternative's name stands nowhere
        (("objects", 1, "shape", "kind"), 7),
        (("objects", 2, "shape"), 3),
    ],
)
def test_the_line_of_a_place(tmp_path, place, line):
    path = tmp_path / "x.yaml"
    path.write_text(PLACES)
    assert line_of(path, place) == line


def test_a_minus_sign_before_a_number_becomes_a_hyphen():
    assert plain_text("\u221230") == "-30"
    assert plain_text("bar \u22127.5 \u2212 x") == "bar -7.5 \u2212 x"
    assert plain_text("a\u22121") == "a\u22121"  # a difference, not a sign
