"""`ajgdata import`: labels, grasps and samples from tables and file names, and what is reported."""

import csv

import pytest
import soundfile
from worlds import RATE_HZ, assert_one_line, tone, write_tone

import ajgdata as library
from ajgdata.types import Target

TABLE = ("--table", "t.csv", "--file", "{name}.wav", "--target", "form")
GRASPS = r"(?P<label>[a-z]+)_g(?P<grasp>\d+)_(?P<sample>[ab])\.wav"


@pytest.fixture
def folder(project):
    return project.root / "recordings"


@pytest.fixture
def rows(project):
    """Rows of recordings.csv of the data set `e`, by recording_id."""

    def read(session="recordings"):
        path = project.paths.session("e", session) / "recordings.csv"
        with path.open(encoding="utf-8", newline="") as stream:
            return {row["recording_id"]: row for row in csv.DictReader(stream)}

    return read


def write(folder, *names):
    for number, name in enumerate(names):
        write_tone(folder / name, 500 + number)


def write_table(folder, text, count=4):
    write(folder, *(f"w{number}.wav" for number in range(count)))
    (folder / "t.csv").write_text(text, encoding="utf-8")


def grasps(rows):
    return {name: row["grasp_id"] for name, row in rows.items()}


def test_a_column_grasp_id_names_the_grasp_and_a_template_the_session(ajgdata, folder, rows):
    write_table(folder, "name,form,Grasp_ID\nw0,pl,S1\nw1,pl,S1\nw2,pt,S2\nw3,pt,S2\n")
    options = ("--session", "day {form}", "--reference")
    code, out, _ = ajgdata("import", folder, "--dataset", "e", *TABLE, *options)
    assert code == 0
    assert grasps(rows("day_pl")) == {"w0": "S1", "w1": "S1"}
    assert grasps(rows("day_pt")) == {"w2": "S2", "w3": "S2"}
    assert {row["file"] for row in rows("day_pl").values()} == {"w0.wav", "w1.wav"}
    assert "grasps               2\n" in out


def test_columns_of_the_data_model_are_used_as_such(ajgdata, folder, rows):
    write_table(
        folder,
        "name,form,Session_ID,recording_id,sample,OBJECT,Quality\n"
        "w0,pl,day1,first,2,box,ok\nw1,pt,day1,second,3,ball,REJECT\n"
        "w2,pl,day2,first,0,box,Clipped\nw3,pt,day2,second,1,ball,\n",
    )
    code, out, _ = ajgdata("import", folder, "--dataset", "e", *TABLE, "--grasp", "{name}")
    assert code == 0
    assert "4 added, 0 changed, 0 unchanged in 2 session(s) of e" in out
    columns = ("sample", "object", "quality", "form", "name")
    assert {n: tuple(r[c] for c in columns) for n, r in rows("day1").items()} == {
        "first": ("2", "box", "ok", "pl", "w0"),
        "second": ("3", "ball", "reject", "pt", "w1"),
    }
    assert [row["quality"] for row in rows("day2").values()] == ["clipped", "ok"]
    assert "0 added, 0 changed, 4 unchanged" in ajgdata("import", folder, "--dataset", "e")[1]


def test_a_grasp_number_counts_within_its_object(ajgdata, folder, rows):
    names = [f"{o}_g{g}_{s}.wav" for o in ("box", "ball") for g in (1, 2) for s in "ab"]
    write(folder, *names)
    code, out, _ = ajgdata("import", folder, "--dataset", "e", "--pattern", GRASPS)
    assert code == 0
    assert len(set(grasps(rows()).values())) == 4
    for prefix in ("box_g1", "box_g2", "ball_g1", "ball_g2"):
        first = rows()[f"{prefix}_a"]
        second = rows()[f"{prefix}_b"]
        assert first["grasp_id"] == second["grasp_id"]
        assert (first["sample"], second["sample"]) == ("0", "1")
    assert "samples per grasp     2 (4 grasps)" in out


def test_grasps_with_two_objects_or_target_values_are_a_warning(ajgdata, folder):
    names = [f"{o}_g{g}_{s}.wav" for o in ("box", "ball") for g in (1, 2, 3) for s in "ab"]
    write(folder, *names[:-1])
    code, out, _ = ajgdata(
        "import", folder, "--dataset", "e", "--pattern", GRASPS, "--grasp", "{grasp}"
    )
    assert code == 3
    mixed = "recordings/1 (ball, box), recordings/2 (ball, box), recordings/3 (ball, box)"
    assert f"warning 3 of 3 grasps have more than one object: {mixed}; give each grasp" in out
    assert f"warning 3 of 3 grasps have more than one value of label: {mixed}" in out
    code, out, _ = ajgdata("check", "e")
    assert code == 3
    assert "3 of 3 grasps have more than one value of label" in out


def test_a_pattern_with_samples_names_their_grasps(ajgdata, folder, project):
    write(folder, *(f"{o}_g1_{s}.wav" for o in ("box", "ball") for s in "ab"))
    options = ("import", folder, "--dataset", "e", "--pattern")
    code, _, err = ajgdata(*options, r"(?P<label>[a-z]+)_g1_(?P<Sample>[ab])\.wav")
    assert code == 1
    assert_one_line(err, "--pattern: names `sample` without `grasp`")
    assert not project.paths.dataset("e").exists()
    assert ajgdata(*options, GRASPS)[0] == 0


def write_simulated(folder, *names):
    write(folder, *names)
    for number, name in enumerate(names):
        with soundfile.SoundFile(folder / name, "w", RATE_HZ, 1, "PCM_24") as file:
            file.comment = "Simulated by a program"
            file.write(tone(300 + 50 * number))


def test_files_with_the_comment_simulated_are_simulated(ajgdata, folder, project):
    write_simulated(folder, "1_box.wav", "2_ball.wav")
    project.declare(targets={"label": {"kind": "classification"}})
    code, out, _ = ajgdata("import", folder, "--dataset", "d")
    assert code == 0
    assert "note simulated: the comments in the files state this\n" in out
    project.build("recordings", targets={"label": Target(kind="classification")})
    assert project.store().attrs["source"] == "simulated"
    assert library.load_recordings("d", project.root).attrs["source"] == "simulated"
    write_simulated(folder, "1_box.wav", "2_ball.wav", "3_box.wav")
    assert "1 added, 0 changed, 2 unchanged" in ajgdata("import", folder, "--dataset", "d")[1]
    write(folder, "4_box.wav")
    code, _, err = ajgdata("import", folder, "--dataset", "d")
    assert code == 1
    assert_one_line(err, "recordings: 3 of 4 files are simulated, e.g. 1_box.wav. Move them to")


def test_one_class_is_no_task(ajgdata, folder):
    write(folder, "1_metal.wav", "2_metal.wav")
    code, out, _ = ajgdata("import", folder, "--dataset", "e")
    assert code == 0
    assert "warning task label is not possible: 'metal' is its only class; record or import" in out
    write(folder, "1_metal.wav", "2_metal.wav", "3_wood.wav")
    code, out, _ = ajgdata("import", folder, "--dataset", "e")
    assert "not possible" not in out


def test_files_that_are_not_sounds_declare_nothing(ajgdata, folder, project):
    folder.mkdir()
    (folder / "1_a.wav").write_text("a text file")
    code, out, err = ajgdata("import", folder, "--dataset", "e")
    assert (code, out) == (1, "")
    assert "1_a.wav" in err and err.count("\n") == 1
    assert not project.paths.dataset("e").exists()
