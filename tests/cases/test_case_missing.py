"""Missing values, cells that are no numbers, and classes that differ in spelling only."""

from __future__ import annotations

import pytest
from sounds import resonances, write_wav

from ajgdata.store.sessions import read_dataset

NUMBERS = [str(10 + number) for number in range(24)]


def import_column(ajgdata, src, texts):
    lines = ["name;label"]
    for number, text in enumerate(texts):
        write_wav(src / f"r{number:02d}.wav", resonances(0, number, frames=2048))
        lines.append(f"r{number:02d};{text}")
    (src / "t.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    table = ("--table", "t.csv", "--file", "{name}.wav", "--target", "label")
    return ajgdata("import", src, "--dataset", "d", *table, "--all")


@pytest.mark.parametrize("text", ["NA", "n/a", "-", "?", "#DIV/0!", "#N/A", "inf", "None"])
def test_a_missing_number_is_declared_and_listed(src, ajgdata, paths, text):
    printed = import_column(ajgdata, src, [*NUMBERS[:3], text, *NUMBERS[4:]])
    assert printed.code == 0, printed.text
    target = read_dataset(paths, "d").targets["label"]
    assert (target.kind, target.missing) == ("regression", (text,))
    assert f"{text!r} is missing in 1 recordings: r03.wav" in printed.text


@pytest.mark.parametrize("text", ["17,5", "12 mm", "l0"])
def test_a_cell_that_is_no_number_is_named(src, ajgdata, paths, text):
    printed = import_column(ajgdata, src, [*NUMBERS[:7], text, *NUMBERS[8:]])
    assert printed.code == 3
    assert read_dataset(paths, "d").targets["label"].kind == "regression"
    assert f"{text!r} among numbers" in printed.text
    assert "in r07.wav" in printed.text


def test_a_column_of_decimal_commas_is_named(src, ajgdata):
    printed = import_column(ajgdata, src, [f"{number},5" for number in range(24)])
    assert printed.code == 3
    assert "decimal comma" in printed.text


def test_na_among_classes_stays_a_class_with_a_warning(src, ajgdata, paths):
    printed = import_column(ajgdata, src, ["cube", "ball", "NA", "cube", "ball", "NA"])
    assert printed.code == 3
    assert read_dataset(paths, "d").targets["label"].missing == ()
    assert "'NA' in a column of text stay classes" in printed.text


def test_classes_that_differ_in_case_are_all_listed(src, ajgdata):
    printed = import_column(ajgdata, src, ["cube", "Cube", "CUBE", "ball"])
    assert printed.code == 3
    assert "'CUBE', 'Cube', 'cube'" in printed.text
