"""Filters and orders of recordings: which rows they give, and what is wrong in one line."""

import shlex

import numpy as np
import pytest

from ajgdata.browse.query import (
    Condition,
    NumberColumn,
    TextColumn,
    matching,
    ordered,
    parse_filter,
)
from ajgdata.types import DataError
from ajgdata.types.browse_command import browse_command, filter_word

COLUMNS = {
    "label": TextColumn(["wood", "Foam brick", "metal", ""]),
    "issue": TextColumn(["silent clipped", "", "clip", "silent"], has_words=True),
    "confidence": NumberColumn(np.array([0.5, 0.9, np.nan, 0.7])),
    "mass g": NumberColumn(np.array([1.0, 2.0, 3.0, 4.0])),
    "Öl": TextColumn(["nein", "ja", "", ""]),
}


def rows(text):
    return np.flatnonzero(matching(COLUMNS, text, 4)).tolist()


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("", [0, 1, 2, 3]),
        ("label=wood", [0]),
        ("label=WOOD", [0]),
        ("label!=wood", [1, 2, 3]),
        ('label="foam brick"', [1]),
        ("label=", [3]),
        ("label!=", [0, 1, 2]),
        ("label~o", [0, 1]),
        ("issue=silent", [0, 3]),
        ("issue=clip", [2]),
        ("issue!=", [0, 2, 3]),
        ("confidence>0.5", [1, 3]),
        ("confidence>=0.5", [0, 1, 3]),
        ("confidence<0.7", [0]),
        ("confidence=0.7", [3]),
        ("confidence!=0.7", [0, 1, 2]),
        ("confidence=", [2]),
        ("brick", [1]),
        ("SILENT", [0, 3]),
        ("silent confidence>0.6", [3]),
        ('"mass g">2 label!=', [2]),
        ("Öl=ja", [1]),
        ('"foam brick"', [1]),
        ('"confidence>0.6"', []),
    ],
)
def test_filter(text, found):
    assert rows(text) == found


@pytest.mark.parametrize(
    ("sort", "expected"),
    [
        ("", [0, 1, 2, 3]),
        ("confidence", [0, 3, 1, 2]),
        ("-confidence", [1, 3, 0, 2]),
        ("label", [1, 2, 0, 3]),
        ("-label", [0, 2, 1, 3]),
    ],
)
def test_missing_cells_are_last_in_both_orders(sort, expected):
    assert ordered(COLUMNS, np.arange(4), sort).tolist() == expected


def test_the_order_is_of_the_given_rows_and_stable():
    column = {"object": TextColumn(["b", "a", "b", "a"])}
    assert ordered(column, np.array([3, 2, 1, 0]), "object").tolist() == [3, 1, 2, 0]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("labl=wood", "there is no column 'labl'"),
        ("label>3", "needs a column of numbers"),
        ("confidence~9", "needs a column of text"),
        ("confidence>high", "is compared with numbers"),
        ('label="foam', "a quote has no end"),
        ('label=5"', "a quote has no end"),
        ("öl=ja", "there is no column 'öl'"),
    ],
)
def test_a_wrong_filter_is_one_line(text, problem):
    with pytest.raises(DataError, match="--filter") as raised:
        rows(text)
    assert problem in raised.value.problem


def test_a_wrong_order_names_the_columns():
    with pytest.raises(DataError, match="Use one of label, issue, confidence, mass g"):
        ordered(COLUMNS, np.arange(4), "-x")


@pytest.mark.parametrize(
    "value",
    ["wood", "foam brick", "", "#1", "it's", "a\\b", "a=b", '5"', '"', '""', 'a "b" c', '"x y"'],
)
@pytest.mark.parametrize("column", ["label", "mass g", "Öl", "a=b", 'edge "'])
def test_a_written_condition_is_read_again(column, value):
    words = [filter_word(column, value), filter_word("label", value)]
    expected = [Condition(column, "=", value), Condition("label", "=", value)]
    assert parse_filter(" ".join(words)) == expected


def test_many_quotes_take_no_time():
    assert parse_filter('"' * 2_000)[0].value == '"' * 999


def test_the_command_of_a_cell_has_its_filter_as_one_argument():
    words = [filter_word("label", "foam brick"), filter_word("predicted", "wood")]
    command = browse_command("ycb", words, predictions="object/cnn", sort="-confidence")
    *front, given, sort = shlex.split(command)
    assert front == ["ajgdata", "browse", "ycb", "--predictions", "object/cnn", "--filter"]
    assert sort == "--sort=-confidence"
    assert parse_filter(given) == [
        Condition("label", "=", "foam brick"),
        Condition("predicted", "=", "wood"),
    ]
