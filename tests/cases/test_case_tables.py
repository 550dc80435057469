"""Tables of labels as spreadsheets and programs write them, and the files that rows name."""

from __future__ import annotations

import unicodedata

import pytest
from sounds import resonances, write_wav


def recordings(folder, names):
    for number, name in enumerate(names):
        write_wav(folder / name, resonances(number % 2, number))


def import_table(ajgdata, src, text, file="{name}.wav"):
    (src / "labels.csv").write_text(text, encoding="utf-8")
    return ajgdata(
        *("import", src, "--dataset", "d", "--table", "labels.csv", "--file", file),
        *("--target", "label"),
    )


def labels(rows):
    return {row["file"].removeprefix("audio/"): row["label"] for row in rows("d")}


FOUR = ("00.wav", "01.wav", "10.wav", "11.wav")
RIGHT = {"00.wav": "cube", "01.wav": "cube", "10.wav": "ball", "11.wav": "ball"}
TABLES = [
    (",name,label\n0,00,cube\n1,01,cube\n2,10,ball\n3,11,ball\n", "{name}.wav", 0, "column 1"),
    ("name;label;;\n00;cube;;\n01;cube;;\n10;ball;;\n11;ball;;\n;;;\n", "{name}.wav", 0, ""),
    ("# Monday\nname,label\n00,cube\n01,cube\n10,ball\n11,ball\n", "{name}.wav", 0, "comment"),
    ("name,label\n0.0,cube\n1.0,cube\n10.0,ball\n11.0,ball\n", "{name}.wav", 3, "zeros"),
    ("name,label\n0,cube\n1,cube\n10,ball\n11,ball\n", "{name}.wav", 3, "2 file names"),
    ("n,label\n./00.wav,cube\n./01.wav,cube\n./10.wav,ball\n./11.wav,ball\n", "{n}", 0, ""),
]


@pytest.mark.parametrize(("text", "file", "code", "said"), TABLES)
def test_tables_of_programs_give_the_right_labels(src, ajgdata, rows, text, file, code, said):
    recordings(src, FOUR)
    printed = import_table(ajgdata, src, text, file=file)
    assert printed.code == code, printed.text
    assert said in printed.text
    assert labels(rows) == RIGHT


@pytest.mark.parametrize("start", [b"PK\x03\x04", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"])
def test_a_workbook_is_named_whatever_its_ending(src, ajgdata, start):
    recordings(src, FOUR)
    (src / "labels.csv").write_bytes(start + bytes(range(256)))
    printed = ajgdata(
        *("import", src, "--dataset", "d", "--table", "labels.csv"),
        *("--file", "{name}.wav", "--target", "label"),
    )
    assert printed.code == 1
    assert "is a workbook" in printed.text
    assert "Export it as CSV" in printed.text


def test_an_unnamed_column_with_contents_is_refused(src, ajgdata):
    recordings(src, FOUR)
    printed = import_table(ajgdata, src, "name,label,\n00,cube,x\n01,cube,\n")
    assert printed.code == 1
    assert "labels.csv:2: column 3 has no name, but contents: 'x'" in printed.text


def test_a_name_that_begins_with_a_space_is_that_file(src, ajgdata, rows):
    recordings(src, [" a.wav", "a.wav", " b.wav", "b.wav"])
    assert import_table(ajgdata, src, "name,label\n a,cube\n b,ball\n").code == 0
    assert labels(rows) == {" a.wav": "cube", " b.wav": "ball"}


def test_a_file_in_another_unicode_form_is_noted(src, ajgdata, rows):
    decomposed = unicodedata.normalize("NFD", "würfel.wav")
    recordings(src, [decomposed, "Ball.wav"])
    printed = import_table(ajgdata, src, "name,label\nwürfel,cube\nball,ball\n")
    assert printed.code == 0, printed.text
    assert "1 file names match only without regard to Unicode form" in printed.text
    assert "u\\u0308" in printed.text
    assert "without regard to upper and lower case" in printed.text
    assert sorted(labels(rows).values()) == ["ball", "cube"]


def test_two_rows_that_mean_one_file_are_refused(src, ajgdata):
    recordings(src, ["a.wav", "b.wav"])
    printed = import_table(ajgdata, src, "name,label\na,cube\nA,ball\n")
    assert printed.code == 1
    assert "a.wav is in two rows, as 'a.wav' and as 'A.wav'" in printed.text


def test_a_name_that_two_files_fit_is_not_guessed(src, ajgdata, rows):
    recordings(src, ["01.wav", "001.wav", "2.wav", "3.wav"])
    printed = import_table(ajgdata, src, "name,label\n1,cube\n2,ball\n3,cube\n")
    assert printed.code == 3
    assert "several files have this name" in printed.text
    assert labels(rows) == {"2.wav": "ball", "3.wav": "cube"}


@pytest.mark.parametrize("options", [(), ("--reference",)])
def test_twins_that_differ_in_a_space_are_two_recordings(src, ajgdata, rows, options):
    recordings(src, [" a.wav", "a.wav", " b.wav", "b.wav"])
    (src / "t.csv").write_text("name,label\n a,cube\na,ball\n b,cube\nb,ball\n")
    table = ("--table", "t.csv", "--file", "{name}.wav", "--target", "label")
    assert ajgdata("import", src, "--dataset", "d", *table, *options).code == 0
    cells = rows("d")
    assert {row["recording_id"] for row in cells} == {"_a", "a", "_b", "b"}
    assert len({row["grasp_id"] for row in cells}) == 4
    assert "4 recordings checked: 0 errors, 0 warnings" in ajgdata("check", "d").text
    again = ajgdata("import", src, "--dataset", "d", *options)
    assert "0 added, 0 changed, 4 unchanged" in again.text
