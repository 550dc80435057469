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
    assert "1 file name matches only without regard to Unicode form" in printed.text
    assert r"würfel.wav (table) is 'wu\u0308rfel.wav' (folder)" in printed.text
    assert "without regard to upper and lower case" in printed.text
    assert sorted(labels(rows).values()) == ["ball", "cube"]


def test_two_rows_that_mean_one_file_by_one_step_are_refused(src, ajgdata, paths):
    recordings(src, ["a.wav", "b.wav"])
    printed = import_table(ajgdata, src, "name,label\nb,cube\nA,cube\n A,ball\n")
    assert printed.code == 1
    assert "a.wav is in two rows, as A.wav and as ' A.wav'" in printed.text
    assert not paths.dataset("d").exists()


@pytest.mark.parametrize(
    ("looser", "printed_name"),
    [("A", "A.wav"), (" a", "' a.wav'"), ("a\xa0", r"'a\xa0.wav'")],
)
@pytest.mark.parametrize("is_first", [True, False])
def test_the_exact_row_has_the_file(src, ajgdata, rows, looser, printed_name, is_first):
    recordings(src, ["a.wav", "b.wav"])
    lines = [f"{looser},ball", "a,cube"] if is_first else ["a,cube", f"{looser},ball"]
    printed = import_table(ajgdata, src, "\n".join(["name,label", *lines, "b,ball", ""]))
    assert printed.code == 3
    assert labels(rows) == {"a.wav": "cube", "b.wav": "ball"}
    assert f"failed {printed_name}: in labels.csv but not in the folder" in printed.text
    assert "a.wav is the file of the row a.wav" in printed.text


NAMES = [
    (".\\wav\\a.wav", "wav/a.wav", "blanks"),
    ("./wav/a.wav", "wav/a.wav", ""),
    ("wav/a.wav\xa0", "wav/a.wav", "blanks"),
    ("\u200bwav/a.wav", "wav/a.wav", "blanks"),
    ("WAV/A.WAV", "wav/a.wav", "case"),
    ("\u00dcbung.wav", "u\u0308bung.wav", "case"),
    ("7.wav", "007.wav", "zeros"),
    ("7.0.wav", "007.wav", "zeros"),
    ("7.5.wav", "7.5.wav", ""),
    ("take 1.wav", "take 001.wav", "zeros"),
]


@pytest.mark.parametrize(("cell", "file", "step"), NAMES)
def test_a_name_is_matched_by_the_first_step_that_finds_it(src, ajgdata, rows, cell, file, step):
    recordings(src, [file, "other.wav"])
    table = f"file,label\n{cell},cube\nother.wav,ball\n"
    printed = import_table(ajgdata, src, table, file="{file}")
    assert labels(rows) == {file: "cube", "other.wav": "ball"}
    steps = printed.text.partition("only without regard to ")[2]
    assert (step in steps.partition(":")[0]) if step else not steps
    assert printed.code == (3 if step == "zeros" else 0)


@pytest.mark.parametrize("cell", ["1.5.wav", "10.wav", "a 1.wav", '""'])
def test_a_name_that_is_another_number_has_no_file(src, ajgdata, rows, cell):
    recordings(src, ["1.wav", "a.wav", "b.wav"])
    table = f"file,label\n{cell},cube\na.wav,ball\nb.wav,cube\n"
    printed = import_table(ajgdata, src, table, file="{file}")
    assert printed.code == 3
    assert labels(rows) == {"a.wav": "ball", "b.wav": "cube"}
    shown = "''" if cell == '""' else cell
    assert f"failed {shown}: in labels.csv" in printed.text


@pytest.mark.parametrize("title", ["Recorded on Monday;;", "sep=;", "% recorded on Monday"])
def test_a_line_above_the_header_is_named(src, ajgdata, paths, title):
    recordings(src, FOUR)
    printed = import_table(ajgdata, src, f"{title}\nname;label\n00;cube\n01;ball\n")
    assert printed.code == 1
    assert "labels.csv:1:" in printed.text
    assert "is not the header, which is line 2. Delete line 1" in printed.text
    assert not paths.dataset("d").exists()


@pytest.mark.parametrize("end", ["\r", "\r\n"])
def test_ends_of_lines_of_other_systems_are_read(src, ajgdata, rows, end):
    recordings(src, FOUR)
    lines = ["name;label", "00;cube", "01;cube", "10;ball", "11;ball", ""]
    assert import_table(ajgdata, src, end.join(lines)).code == 0
    assert labels(rows) == RIGHT


HEADERS = [
    ('name;label;"mass, dry; in g"', ";"),
    ('name,label,"a;b;c;d"', ","),
    ('name\tlabel\t"x;y,z"', "\t"),
    ('"a,b,c,d";name;label', ";"),
]


@pytest.mark.parametrize(("header", "delimiter"), HEADERS)
def test_the_delimiter_is_that_between_the_names(src, ajgdata, rows, header, delimiter):
    recordings(src, FOUR)
    is_first = header.startswith('"')
    lines = [header]
    for name, label in RIGHT.items():
        cells = [name.removesuffix(".wav"), label]
        lines.append(delimiter.join(["1", *cells] if is_first else [*cells, "1"]))
    assert import_table(ajgdata, src, "\n".join(lines) + "\n").code == 0
    assert labels(rows) == RIGHT


@pytest.mark.parametrize(("delimiter", "words"), [(",", "commas"), (";", "semicolons")])
def test_a_wrong_header_names_the_delimiter(src, ajgdata, delimiter, words):
    recordings(src, FOUR)
    lines = ["name,label,label", "00,cube,x", "01,ball,y"]
    text = "\n".join(lines).replace(",", delimiter)
    printed = import_table(ajgdata, src, text)
    assert printed.code == 1
    assert f"with {words} between the cells" in printed.text


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
