"""Grasps: templates with empty cells, spellings in several places, labels that keep theirs."""

import pytest
from sounds import resonances, write_wav

NAMES = r"(?P<label>[a-z]+)-g(?P<grasp>[^-]+)-s(?P<sample>[^-]+)\.wav"


def write_table(src, lines, header="file;label;Grasp"):
    """Write a table and a recording for each of its rows; the first cell is the file."""
    text = "\n".join([header, *lines])
    (src / "labels.csv").write_text(f"{text}\n", encoding="utf-8")
    for number, line in enumerate(lines):
        name = line.partition(";")[0]
        write_wav(src / f"{name}.wav", resonances(number % 2, number, frames=2205))


def import_table(ajgdata, src, *options):
    """Import the table of `write_table`."""
    table = ("--table", "labels.csv", "--file", "{file}.wav", "--target", "label")
    return ajgdata("import", src, "--dataset", "mine", *table, *options)


def import_names(ajgdata, src, names, pattern=NAMES):
    """Write recordings and import them by their names."""
    for number, name in enumerate(names):
        write_wav(src / name, resonances(number % 2, number, frames=2205))
    return ajgdata("import", src, "--dataset", "mine", "--pattern", pattern)


def merged_rows(value=str):
    """Eight grasps of five samples; only the first row of a grasp names it."""
    return [
        f"rec{5 * grasp + sample:02d};{('cube', 'ball')[grasp % 2]};"
        + (value(grasp + 1) if sample == 0 else "")
        for grasp in range(8)
        for sample in range(5)
    ]


@pytest.mark.parametrize(
    ("header", "options"),
    [
        ("file;label;Grasp", ()),
        ("file;label;grasp_id", ()),
        ("file;label;Griff", ("--grasp", "{Griff}")),
        ("file;label;Griff", ("--grasp", "no. {Griff}")),
    ],
)
def test_rows_without_a_grasp_are_counted(ajgdata, src, rows, header, options):
    write_table(src, merged_rows(), header)
    imported = import_table(ajgdata, src, *options)
    assert imported.code == 3
    assert "warning 32 of 40 rows have no grasp: " in imported.text
    assert "is a grasp of its own" in imported.text
    assert "(rec01.wav, rec02.wav, rec03.wav and 29 more)" in imported.text
    assert len({row["grasp_id"] for row in rows("mine")}) == 40
    assert import_table(ajgdata, src, *options).code == 3


def test_filled_cells_are_no_warning(ajgdata, src):
    lines = [f"r{n};{('cube', 'ball')[n // 6]};{n // 2}" for n in range(12)]
    write_table(src, lines)
    imported = import_table(ajgdata, src)
    assert imported.code == 0
    assert "warning" not in imported.text


def test_numbers_without_any_object_are_no_warning(ajgdata, src):
    lines = [f"r{n};{n // 2};{'ab'[n % 2]}" for n in range(8)]
    write_table(src, lines, "file;grasp;form")
    table = ("--table", "labels.csv", "--file", "{file}.wav", "--target", "form")
    imported = ajgdata("import", src, "--dataset", "mine", *table)
    assert "no object" not in imported.text


def test_spellings_in_cells_of_a_table_are_one_grasp(ajgdata, src, rows):
    cells = ("1", "01", "001", "1.0", " 1", "1.00", "-1", "A01", "A1", "1e3", "1000", "1.5")
    write_table(src, [f"r{n:02d};cube;{cell}" for n, cell in enumerate(cells)], "file;label;grasp")
    import_table(ajgdata, src)
    ids = [row["grasp_id"] for row in rows("mine")]
    assert ids[:6] == ["cube/1"] * 6
    assert ids[6:] == [f"cube/{cell}" for cell in cells[6:]]


@pytest.mark.parametrize(
    ("header", "options"),
    [("file;label;grasp_id", ()), ("file;label;Griff", ("--grasp", "{Griff}"))],
)
def test_pure_numbers_of_grasp_id_and_templates_are_joined(ajgdata, src, rows, header, options):
    cells = ("1", "01", "1.0", "S01", "S1")
    write_table(src, [f"r{n};cube;{cell}" for n, cell in enumerate(cells)], header)
    imported = import_table(ajgdata, src, *options)
    assert [row["grasp_id"] for row in rows("mine")] == ["1", "1", "1", "S01", "S1"]
    assert "note 1 number of " in imported.text
    assert "is spelled in several ways: " in imported.text
    assert "e.g. '01', '1', '1.0'" in imported.text


def test_a_number_within_a_template_is_joined(ajgdata, src, rows):
    write_table(src, [f"r{n};cube;{cell}" for n, cell in enumerate(("7", "07", "7.0"))])
    import_table(ajgdata, src, "--grasp", "{label} no. {Grasp}")
    assert {row["grasp_id"] for row in rows("mine")} == {"cube no. 7"}


def test_labels_keep_their_spelling(ajgdata, src, rows):
    write_table(src, ["r0;01;1", "r1;1;01", "r2;2;2"])
    import_table(ajgdata, src, "--grasp", "{label}")
    assert [row["label"] for row in rows("mine")] == ["01", "1", "2"]
    assert [row["grasp_id"] for row in rows("mine")] == ["1", "1", "2"]


@pytest.mark.parametrize(
    ("header", "options"),
    [("file;label;grasp_id", ()), ("file;label;Griff", ("--grasp", "{Griff}"))],
)
def test_a_later_row_joins_the_known_spelling(ajgdata, src, rows, header, options):
    write_table(src, ["r0;cube;01", "r1;ball;02"], header)
    import_table(ajgdata, src, *options)
    write_table(src, ["r0;cube;01", "r1;ball;02", "r2;cube;1.0"], header)
    assert "label r" not in ajgdata("import", src, "--dataset", "mine").text
    assert [row["grasp_id"] for row in rows("mine")] == ["01", "02", "01"]


def test_spellings_in_the_data_of_an_older_version_are_an_issue(ajgdata, src, paths):
    names = [f"{label}-g{n}-s1.wav" for label in ("cube", "ball") for n in (1, 2)]
    import_names(ajgdata, src, names)
    assert "grasp_spelling" not in ajgdata("check", "mine").text
    table = paths.recordings_file("mine", "src")
    text = table.read_text(encoding="utf-8")
    older = text.replace("cube/2,1,cube", "cube/01,2,cube")
    assert older != text
    table.write_text(older, encoding="utf-8")
    checked = ajgdata("check", "mine")
    assert checked.code == 3
    split = "1 of 3 grasps have several spellings of a number: src/cube/1 (cube/1, cube/01)"
    assert f"warning grasp_spelling */*: {split}" in checked.text
    listed = ajgdata("import", src, "--dataset", "mine")
    assert listed.code == 3
    assert split in listed.text
    assert "cube-g2-s1: grasp_id 'cube/01' here, 'cube/2' in the folder" in listed.text
