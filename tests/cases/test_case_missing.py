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
    assert f"note target label: {text!r} is missing in 1 recording: r03.wav" in printed.text


@pytest.mark.parametrize("text", ["17,5", "12 mm", "l0"])
def test_a_cell_that_is_no_number_is_named(src, ajgdata, paths, text):
    printed = import_column(ajgdata, src, [*NUMBERS[:7], text, *NUMBERS[8:]])
    assert printed.code == 3
    assert read_dataset(paths, "d").targets["label"].kind == "regression"
    problem = f"target label: 1 of 24 cells is not a number: {text!r} (r07.wav)"
    assert f"warning {problem}" in printed.text
    assert "under `missing`" in printed.text
    assert "23 numbers, 23 distinct; 1 not a number" in printed.text


def test_a_later_cell_that_is_no_number_is_named(src, ajgdata):
    assert import_column(ajgdata, src, NUMBERS).code == 0
    write_wav(src / "r90.wav", resonances(0, 90, frames=2048))
    with (src / "t.csv").open("a", encoding="utf-8") as table:
        table.write("r90;12 mm\n")
    printed = ajgdata("import", src, "--dataset", "d")
    assert printed.code == 3
    assert "1 cell is not a number in label: '12 mm' (src/r90)" in printed.text


COMMAS = [
    ([f"{number},5" for number in range(24)], 24),
    ([*NUMBERS[:6], *[f"{number},25" for number in range(6)]], 6),
    ([f"1.{number}00,5" for number in range(1, 10)] + ["1,0", "2,0"], 11),
]


@pytest.mark.parametrize(("texts", "count"), COMMAS)
def test_a_column_of_decimal_commas_is_named(src, ajgdata, paths, texts, count):
    printed = import_column(ajgdata, src, texts)
    assert printed.code == 3
    assert f"{count} of {len(texts)} cells are written with a decimal comma" in printed.text
    assert read_dataset(paths, "d").targets["label"].kind == "classification"


def test_few_texts_with_commas_are_classes(src, ajgdata):
    assert import_column(ajgdata, src, ["7,5", "10,0"] * 3).code == 0


def test_several_words_for_a_missing_number_are_all_listed(src, ajgdata, paths):
    texts = [*NUMBERS[:16], "NA", "NA", "-", "#DIV/0!", "", "NaN"]
    printed = import_column(ajgdata, src, texts)
    assert printed.code == 0, printed.text
    target = read_dataset(paths, "d").targets["label"]
    assert (target.kind, target.missing) == ("regression", ("#DIV/0!", "-", "NA", "NaN"))
    assert "'NA' is missing in 2 recordings: r16.wav, r17.wav" in printed.text


def test_none_among_classes_is_a_class_without_a_warning(src, ajgdata, paths):
    assert import_column(ajgdata, src, ["cube", "none", "10", "none"]).code == 0
    assert read_dataset(paths, "d").targets["label"].missing == ()


def test_na_among_few_numbers_is_missing(src, ajgdata, paths):
    printed = import_column(ajgdata, src, [*["10", "20"] * 4, "NA"])
    assert printed.code == 0, printed.text
    target = read_dataset(paths, "d").targets["label"]
    assert (target.kind, target.missing) == ("classification", ("NA",))
    assert "'NA' is missing in 1 recording: r08.wav" in printed.text


def test_the_share_of_numbers_counts_cells(src, ajgdata, paths):
    """Repeated numbers with rare errors are numbers; one number per recording is not enough."""
    import_column(ajgdata, src, [*NUMBERS[:11] * 2, "a", "b", "c", "d"])
    assert read_dataset(paths, "d").targets["label"].kind == "regression"


def test_rare_numbers_among_classes_are_classes(src, ajgdata, paths):
    printed = import_column(ajgdata, src, [*NUMBERS[:11], *["cube"] * 12])
    assert read_dataset(paths, "d").targets["label"].kind == "classification"
    assert "not numbers" not in printed.text


def test_a_class_that_is_mostly_numbers_is_a_warning(src, ajgdata, paths):
    printed = import_column(ajgdata, src, [*NUMBERS[:14], *["lost"] * 6])
    assert printed.code == 3
    assert read_dataset(paths, "d").targets["label"].kind == "classification"
    assert "only 6 of 20 cells are not numbers" in printed.text
    assert "'lost' (r14.wav, r15.wav, r16.wav and 3 more)" in printed.text


@pytest.mark.parametrize("text", ["NA", "nan", "null", "-", "?", "#N/A"])
def test_na_among_classes_stays_a_class_with_a_warning(src, ajgdata, paths, text):
    printed = import_column(ajgdata, src, ["cube", "ball", text, "cube", "ball", text])
    assert printed.code == 3
    assert read_dataset(paths, "d").targets["label"].missing == ()
    problem = "2 of 6 cells are probably missing, but a class of its own"
    assert f"{problem}: {text!r} (r02.wav, r05.wav)" in printed.text
    assert "`missing` of the target in dataset.yaml" in printed.text


SPELLINGS = [
    (["cube", "Cube", "CUBE", "ball", "cube"], "'cube' 2; 'CUBE' 1; 'Cube' 1"),
    (["cube", "cube.", "ball"], "'cube' 1; 'cube.' 1"),
    (["steel ball", "steel_ball", "Steel-Ball"], "'Steel-Ball' 1; 'steel ball' 1; 'steel_ball' 1"),
    (["Würfel", "wu\u0308rfel", "ball"], "'Würfel' 1; 'würfel' 1"),
]


@pytest.mark.parametrize(("texts", "listed"), SPELLINGS)
def test_classes_that_differ_in_spelling_are_all_listed(src, ajgdata, texts, listed):
    printed = import_column(ajgdata, src, texts)
    assert printed.code == 3
    assert f"classes of label differ only in spelling: {listed};" in printed.text
    checked = ajgdata("check", "d")
    assert checked.code == 3
    assert f"warning similar_classes */*: classes of label differ only in spelling: {listed}" in (
        checked.text
    )
    assert "similar_classes 1" in checked.text


@pytest.mark.parametrize("texts", [["cube ", " cube", "ball"], ["wu\u0308", "w\xfc", "ball"]])
def test_blanks_and_unicode_forms_of_a_class_are_one_class(src, ajgdata, rows, texts):
    printed = import_column(ajgdata, src, texts)
    assert printed.code == 0, printed.text
    assert len({row["label"] for row in rows("d")}) == 2


@pytest.mark.parametrize("texts", [["t-30", "t30"], ["1 1", "11"], ["a+", "a"], ["cube", "cubes"]])
def test_other_classes_are_not_similar(src, ajgdata, texts):
    assert "spelling" not in import_column(ajgdata, src, [*texts, "ball"]).text


def test_corrected_classes_are_no_longer_an_issue(src, ajgdata):
    assert import_column(ajgdata, src, ["cube", "Cube", "ball"]).code == 3
    table = src / "t.csv"
    table.write_text(table.read_text().replace("Cube", "cube"))
    assert ajgdata("import", src, "--dataset", "d", "--on-change", "labels").code == 0
    assert "similar_classes" not in ajgdata("check", "d").text
