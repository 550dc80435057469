"""Folders as people have them: which file is which recording, and what is left out and why."""

from pathlib import Path

import pytest

from ajgdata.store.scan import scan
from ajgdata.types import DataError, ImportSettings
from ajgdata.types.session import is_reserved

KIT = ImportSettings(pattern="starter-kit")


def files(folder: Path, *names: str) -> Path:
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"RIFF")
    return folder


def scanned(folder, **settings):
    return scan(folder, ImportSettings(**settings), "d")


def test_starter_kit(tmp_path):
    files(
        tmp_path,
        *("0_sweep.wav", "1_no object.wav", "2_größe_10.WAV", "10_no object.wav"),
        *("Day 1/left/00_sweep.wav", "Day 1/left/3_cube.ogg", "Day 1/left/notes.txt"),
        *("Day 1/4_cube.txt", ".hidden/5_cube.wav", "._6_cube.wav", "cube.wav", "x/7_a.b.flac"),
    )
    result = scan(tmp_path, KIT, "d")
    assert [(f.path.as_posix(), f.session, f.text("object")) for f in result.files] == [
        ("10_no object.wav", "d", "no object"),
        ("1_no object.wav", "d", "no object"),
        ("2_größe_10.WAV", "d", "größe_10"),
        ("Day 1/left/3_cube.ogg", "Day_1_left", "cube"),
        ("x/7_a.b.flac", "x", "a.b"),
    ]
    assert result.files[1].labels == {"n": "1", "label": "no object"}
    assert result.files[3].cells["grasp_id"] == "Day 1/left/3_cube"
    assert dict(result.remarks) == {
        "not used": [
            ("0_sweep.wav", "the played sound"),
            ("Day 1/left/00_sweep.wav", "the played sound"),
            ("cube.wav", "does not match the pattern"),
        ]
    }


def test_regular_expression_with_roles(tmp_path):
    files(tmp_path, "001 - Dog bark/1-2-A.ogg", "002 - Rain/5-77-B.ogg", "README.wav")
    result = scanned(
        tmp_path,
        pattern=r"\d+ - (?P<label>[^/]+)/(?P<fold>\d)-(?P<clip>\d+)-(?P<take>[A-Z])\.ogg",
        grasp="clip {clip}",
        session="fold {fold}",
        object="{label}!",
    )
    dog, rain = result.files
    assert dog.session == "fold_1"
    assert (dog.cells["grasp_id"], dog.cells["object"]) == ("clip 2", "Dog bark!")
    assert rain.labels == {"label": "Rain", "fold": "5", "clip": "77", "take": "B"}
    assert result.remarks["not used"] == [("README.wav", "does not match the pattern")]


@pytest.mark.parametrize(
    ("said", "sample"),
    [("03", "3"), ("3.0", "3"), ("", "0"), ("x", "0"), ("-1", "0")],
)
def test_the_number_of_a_repeat_as_spreadsheets_write_it(tmp_path, said, sample):
    table(files(tmp_path, "a.wav"), f'name,sample\na,"{said}"\n')
    (file,) = scanned(tmp_path, table="t.csv", file="{name}.wav", grasp="{name}").files
    assert file.cells["sample"] == sample


def test_texts_of_sample_are_announced(tmp_path):
    """A user's column `sample` can have another meaning than the number of a repeat."""
    files(tmp_path, "a.wav", "b.wav")
    table(tmp_path, "name,Sample\na,steel\nb,oak\n")
    result = scanned(tmp_path, table="t.csv", file="{name}.wav", grasp="{name}")
    assert [file.cells["sample"] for file in result.files] == ["1", "0"]
    ((subject, reason),) = result.remarks["note"]
    assert subject == "the texts of `sample` are stored as"
    assert "'oak' is 0, 'steel' is 1" in reason


@pytest.mark.parametrize("name", ["validation_fold", "latent_2", "string4", "Quality", "flags"])
def test_no_label_has_a_name_of_a_stored_file(name):
    assert is_reserved(name)
    assert not is_reserved(f"{name}_of_mine")


def table(folder: Path, text: str) -> Path:
    (folder / "t.csv").write_text(text)
    return folder


def test_table(tmp_path):
    files(tmp_path, "wav/a.wav", "wav/b.wav", "wav/c.wav")
    table(tmp_path, "name,mass (g),source,quality\nb,12.5,x,Clipped\na,,y,\nd,1,z,\n")
    result = scanned(
        tmp_path, table="t.csv", file="wav/{name}.wav", grasp="{source}", object="o {name}"
    )
    columns = ("grasp_id", "placement_id", "object", "recording_id", "sample", "quality")
    cells = [[file.cells[column] for column in columns] for file in result.files]
    assert cells == [["y", "", "o a", "", "0", ""], ["x", "", "o b", "", "0", "Clipped"]]
    assert [(f.path.name, f.session) for f in result.files] == [("a.wav", "d"), ("b.wav", "d")]
    # names are fit for every reader; a standard name is used by a template only
    assert result.files[1].labels == {"name": "b", "mass_g": "12.5"}
    assert result.files[0].labels["mass_g"] == ""
    assert dict(result.remarks) == {
        "failed": [("wav/d.wav", "in t.csv but not in the folder")],
        "not used": [("wav/c.wav", "no row in t.csv")],
        "note": [("not stored, because no label can have these names", "source")],
    }


@pytest.mark.parametrize(
    ("columns", "row", "options", "placement"),
    [
        ("object,placement", "cube,2", {}, "cube/2"),  # counted within its object
        ("placement", "2", {}, "2"),
        ("object,placement_id", "cube,p7", {}, "p7"),
        ("object,round", "cube,3", {"placement": "{object} of {round}"}, "cube of 3"),
        ("object,round", "cube,3", {}, ""),
    ],
)
def test_placements_by_column_and_template(tmp_path, columns, row, options, placement):
    table(files(tmp_path, "a.wav"), f"name,{columns}\na,{row}\n")
    (file,) = scanned(tmp_path, table="t.csv", file="{name}.wav", **options).files
    assert file.cells["placement_id"] == placement
    assert "placement" not in file.labels


@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_tables_have_several_delimiters(tmp_path, mark):
    files(tmp_path, "a.wav", "b.wav")
    table(tmp_path, f"name{mark} stone\na{mark}x\nb{mark}y\n{mark}\n")
    result = scanned(tmp_path, table="t.csv", file="{name}.wav")
    labels = [file.labels for file in result.files]
    assert labels == [{"name": "a", "stone": "x"}, {"name": "b", "stone": "y"}]


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"pattern": r".*\.wav"}, r"has no named group. Name the label, e.g. \(\?P<label>"),
        ({"pattern": r"(?P<n>\d+)\.wav"}, "none of its audio files can be imported: '1_a.wav'"),
        ({"table": "none.csv", "file": "{name}"}, "none.csv: there is no such file"),
        ({"table": "t.csv", "file": "{nam}.wav"}, r"--file: '{nam}.wav' names 'nam'. Use one of"),
        ({"table": "t.csv", "file": "1_a.wav"}, "1_a.wav is in two rows"),
        ({"table": "empty.csv", "file": "1_a.wav"}, "empty.csv: needs one name per column"),
    ],
)
def test_what_cannot_be_understood(tmp_path, settings, said):
    files(tmp_path, "1_a.wav", "2_b.wav")
    table(tmp_path, "name\n1_a\n2_b\n")
    (tmp_path / "empty.csv").touch()
    with pytest.raises(DataError, match=said) as caught:
        scanned(tmp_path, **settings)
    assert "\n" not in str(caught.value)
