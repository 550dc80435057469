"""Guesses about file names: fields, roles, and patterns with which the import works."""

import re
import shlex
from pathlib import Path

import pytest
from worlds import write_tone

from ajgdata.store.file_names import name_form
from ajgdata.store.sessions import read_dataset

GRASPS = [f"{o}_g{g:02d}_{s}.wav" for o in ("box", "ball") for g in (1, 2, 3) for s in "ab"]


def groups(names, choice=0):
    """Named groups that a proposal reads from each name of the commonest form."""
    form = name_form([Path(name) for name in names])
    pattern = re.compile(form.pattern(form.proposals()[choice]))
    return [match.groupdict() for match in map(pattern.fullmatch, names) if match]


def test_label_grasp_and_sample_are_guessed():
    form = name_form([Path(name) for name in [*GRASPS, "notes final.wav"]])
    assert [(field.value_type, len(field.values)) for field in form.fields] == [
        ("text", 2),
        ("number", 3),
        ("text", 2),
    ]
    assert form.other_files == (Path("notes final.wav"),)
    rows = groups([*GRASPS, "notes final.wav"])
    assert len(rows) == 12
    assert rows[0] == {"label": "box", "grasp": "01", "sample": "a"}
    assert groups(GRASPS, 1)[0] == {"label": "box", "field_2": "01", "field_3": "a"}


@pytest.mark.parametrize(
    ("names", "first"),
    [
        (["wood/1.wav", "wood/2.wav", "metal/1.wav"], {"label": "wood", "grasp": "1"}),
        (["exp-12mm-1.flac", "exp-18mm-1.flac", "exp-18mm-2.flac"], {"label": "12", "grasp": "1"}),
        (["cube_12_1.wav", "cube_12.7_1.wav", "cube_12.7_2.wav"], {"label": "12", "grasp": "1"}),
        (["12.7mm.1a.wav", "12.75mm.1a.wav", "12.7mm.2a.wav"], {"label": "12.7", "grasp": "1"}),
        (["a (b) 1.wav", "c (b) 1.wav", "c (b) 2.wav"], {"label": "a", "grasp": "1"}),
        (["one.wav", "two.wav"], {"label": "one"}),
        (["1.wav", "2.wav"], {"label": "1"}),
        (["same.wav"], {}),
    ],
)
def test_folders_units_and_odd_names(names, first):
    if first:
        assert groups(names)[0] == first and len(groups(names)) == len(names)
    else:
        assert name_form([Path(name) for name in names]).proposals() == []


def test_import_shows_patterns_that_work(ajgdata, project):
    for number, name in enumerate(GRASPS):
        write_tone(project.root / "takes" / name, 500 + number)
    command = ("import", "takes", "--dataset", "e")
    code, out, err = ajgdata(*command)
    assert code == 1 and not project.paths.dataset("e").exists()
    assert "takes: file names are not <n>_<label>.wav" in err and err.count("\n") == 1
    assert "12 of 12 file names have this form" in out
    proposals = [shlex.split(line) for line in out.splitlines() if line.startswith("  --pattern")]
    assert 2 <= len(proposals) <= 3
    code, out, _ = ajgdata(*command, *proposals[0])
    assert code == 0 and "samples per grasp     2 (6 grasps)" in out
    assert read_dataset(project.paths, "e").tasks["label"].models == ("linear", "knn")
