"""`ajgdata import`: labels, grasps and samples from tables and file names, and what is reported."""

import csv
import unicodedata

import pytest
import yaml
from worlds import assert_one_line, write_tone

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


@pytest.mark.parametrize("name", ["grasp_id", "Grasp_ID", "GRASP ID"])
def test_a_column_grasp_id_names_the_grasp(ajgdata, folder, rows, name):
    write_table(folder, f"name,form,{name}\nw0,pl,S1\nw1,pl,S1\nw2,pt,S2\nw3,pt,S2\n")
    code, out, _ = ajgdata("import", folder, "--dataset", "e", *TABLE)
    assert code == 0
    assert grasps(rows()) == {"w0": "S1", "w1": "S1", "w2": "S2", "w3": "S2"}
    assert set(rows()["w0"]) & {"grasp_id", "Grasp_ID", "GRASP_ID"} == {"grasp_id"}
    assert "grasps               2\n" in out


def test_columns_of_the_data_model_are_used_as_such(ajgdata, folder, rows):
    write_table(
        folder,
        "name,form,Session_ID,recording_id,sample,OBJECT,Quality\n"
        "w0,pl,day1,first,2,box,ok\nw1,pt,day1,second,3,ball,REJECT\n"
        "w2,pl,day2,first,0,box,Clipped\nw3,pt,day2,second,1,ball,\n",
    )
    code, out, _ = ajgdata("import", folder, "--dataset", "e", *TABLE)
    assert code == 0
    assert "4 added, 0 changed, 0 unchanged in 2 session(s) of e" in out
    columns = ("sample", "object", "quality", "form", "name")
    assert {n: tuple(r[c] for c in columns) for n, r in rows("day1").items()} == {
        "first": ("2", "box", "ok", "pl", "w0"),
        "second": ("3", "ball", "reject", "pt", "w1"),
    }
    assert [row["quality"] for row in rows("day2").values()] == ["clipped", "ok"]
    assert list(rows("day1")["first"]) == [
        *("recording_id", "file", "sha256", "grasp_id", "sample", "object", "quality"),
        *("form", "name"),
    ]
    assert "0 added, 0 changed, 4 unchanged" in ajgdata("import", folder, "--dataset", "e")[1]


def test_an_id_from_a_row_may_be_the_name_of_another_file(ajgdata, folder, rows):
    """A file without an id in its row is called by its name, with suffix if that is taken."""
    write_table(folder, "name,form,recording_id\nw0,pl,w1\nw1,pt,\nw2,pl,a\nw3,pt,b\n")
    assert ajgdata("import", folder, "--dataset", "e", *TABLE)[0] == 0
    assert {name: row["name"] for name, row in rows().items()} == {
        "w1": "w0", "w1.wav": "w1", "a": "w2", "b": "w3",
    }  # fmt: skip


@pytest.mark.parametrize("name", ["../../evil", "/etc/x", "a//b"])
def test_an_id_is_a_plain_name(ajgdata, folder, name):
    write_table(folder, f"name,form,recording_id\nw0,pl,{name}\nw1,pt,\n")
    code, out, error = ajgdata("import", folder, "--dataset", "e", *TABLE)
    assert code == 1 and f"recording_id '{name}'" in out + error


def test_groups_of_a_pattern_have_the_same_names(ajgdata, folder, rows):
    write(folder, "mon_7_x_ok_pl.wav", "tue_7_y_Reject_pt.wav", "tue_8_z_ok_pl.wav")
    pattern = (
        r"(?P<session_id>[a-z]+)_(?P<grasp_id>\d)_(?P<recording_id>[xyz])"
        r"_(?P<Quality>[a-zA-Z]+)_(?P<form>\w+)\.wav"
    )
    assert ajgdata("import", folder, "--dataset", "e", "--pattern", pattern)[0] == 0
    assert {name: row["quality"] for name, row in rows("tue").items()} == {"y": "reject", "z": "ok"}
    assert grasps(rows("tue")) == {"y": "7", "z": "8"}
    assert grasps(rows("mon")) == {"x": "7"}


@pytest.mark.parametrize(
    ("columns", "values", "text"),
    [
        ("gripper", "G7", "column 'gripper' has the name of a standard column that no import sets"),
        ("Source", "lab", "column 'Source' has the name of a standard column"),
        ("frequency", "5", "column 'frequency' has the name of a standard column"),
        ("file", "x", "column 'file' has the name of a standard column"),
        ("quality,Quality", "ok,ok", "columns 'quality' and 'Quality' would both be 'quality'"),
        ("session,session_id", "a,b", "columns 'session' and 'session_id' would both be 'session'"),
        ("quality", "rejected", "unknown values of quality: 'rejected' (4); use ok, reject"),
        ("quality", "reject (noise)", "unknown values of quality: 'reject (noise)' (4)"),
        ("QUALITY", "bad", "unknown values of quality: 'bad' (4)"),
        ("recording_id", "x", "several files of a session have the recording_id x; give each"),
    ],
)
def test_what_the_data_model_does_not_allow_stops(ajgdata, project, folder, columns, values, text):
    lines = [
        f"name,form,{columns}",
        *(f"w{n},{'pl' if n % 2 else 'pt'},{values}" for n in range(4)),
    ]
    write_table(folder, "\n".join(lines))
    code, _, error = ajgdata("import", folder, "--dataset", "e", *TABLE)
    assert code == 1
    assert_one_line(error, text)
    assert not (project.root / "data").exists()


def test_a_group_with_a_standard_name_stops(ajgdata, folder):
    write(folder, "a_1.wav")
    code, _, error = ajgdata(
        "import", folder, "--dataset", "e", "--pattern", r"(?P<label>a)_(?P<medium>.)\.wav"
    )
    assert code == 1
    assert_one_line(error, "--pattern: group 'medium' has the name of a standard column")


def test_a_column_with_a_standard_name_may_fill_a_template(ajgdata, folder, rows):
    write_table(folder, "recording,form\nw0,pl\nw1,pt\n", count=2)
    table = ("--table", "t.csv", "--file", "{recording}.wav", "--target", "form")
    assert ajgdata("import", folder, "--dataset", "e", *table)[0] == 0
    assert {name: row["form"] for name, row in rows().items()} == {"w0": "pl", "w1": "pt"}


def test_a_hash_in_the_table_is_compared_with_the_file(ajgdata, folder, rows):
    write_table(folder, "name,form\nw0,pl\nw1,pt\n", count=2)
    assert ajgdata("import", folder, "--dataset", "e", *TABLE)[0] == 0
    digest = rows()["w0"]["sha256"]
    (folder / "t.csv").write_text(f"name,form,sha256\nw0,pl,{digest}\nw1,pt,{digest}\n")
    code, out, _ = ajgdata("import", folder, "--dataset", "f", *TABLE)
    assert code == 3
    assert "1 added" in out
    assert "failed w1.wav: its sha256 is not that of the table" in out


def test_columns_that_are_not_used_are_listed(ajgdata, folder):
    write_table(
        folder,
        "name,form,geol,grasp_id,grasp\nw0,pl,a,S1,1\nw1,pl,b,S1,2\nw2,pt,a,S2,1\nw3,pt,b,S2,2\n",
    )
    (folder / "more.csv").write_text("form;geol;mass\npl;x;3\npt;y;4\n")
    more = (*TABLE, "--join", "more.csv:form")
    out = ajgdata("import", folder, "--dataset", "e", *more)[1]
    assert "note stored, but not a target: name, geol, mass\n" in out
    assert "note more.csv: not used, because a table before has it: geol\n" in out
    assert "note column 'grasp' is not used, because 'grasp_id' names the grasp\n" in out
    out = ajgdata("import", folder, "--dataset", "f", *more, "--grasp", "{form} {grasp}")[1]
    assert "note column 'grasp_id' is not used, because --grasp is '{form} {grasp}'\n" in out
    assert "'grasp' is not used" not in out
    assert "each file is one grasp" not in out
    (folder / "t.csv").write_text("name,form\nw0,pl\nw1,pl\nw2,pt\nw3,pt\n")
    out = ajgdata("import", folder, "--dataset", "g", *TABLE)[1]
    assert "note each file is one grasp, because nothing names the grasp (see --grasp)\n" in out


def test_a_grasp_number_counts_within_its_object(ajgdata, folder, rows):
    names = [f"{o}_g{g}_{s}.wav" for o in ("box", "ball") for g in (1, 2) for s in "ab"]
    write(folder, *names)
    code, out, _ = ajgdata("import", folder, "--dataset", "e", "--pattern", GRASPS)
    assert code == 0
    assert len(set(grasps(rows()).values())) == 4
    for prefix in ("box_g1", "box_g2", "ball_g1", "ball_g2"):
        first, second = rows()[f"{prefix}_a"], rows()[f"{prefix}_b"]
        assert first["grasp_id"] == second["grasp_id"]
        assert (first["sample"], second["sample"]) == ("0", "1")
    assert "note sample: 'a' is 0, 'b' is 1\n" in out
    summary = out.splitlines()[-6:-1]
    assert summary == [
        "recordings            8",
        "objects               2",
        "grasps                4",
        "samples per grasp     2 (4 grasps)",
        "recordings per label  ball 4, box 4",
    ]


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
    code, out, _ = ajgdata("validate", "e")
    assert code == 1
    assert out.count("mixed_grasp") == 3  # two lines and their number
    assert "3 of 3 grasps have more than one value of label" in out
    assert ajgdata("import", folder, "--dataset", "f", "--pattern", GRASPS)[0] == 0
    assert "mixed_grasp" not in ajgdata("validate", "f")[1]


@pytest.mark.parametrize(
    ("texts", "numbers"),
    [
        (["1", "2.0", "3,0", ""], ["1", "2", "3", "0"]),
        (["20251120163402", "20251120163400", "20251120163401", "1"], ["3", "1", "2", "0"]),
        (["left", "right", "1e300", "2"], ["2", "3", "0", "1"]),
    ],
)
def test_samples_are_numbers_or_texts_in_order(ajgdata, folder, rows, texts, numbers):
    cells = "".join(f'w{n},{"pl" if n % 2 else "pt"},"{text}"\n' for n, text in enumerate(texts))
    write_table(folder, "name,form,sample\n" + cells)
    assert ajgdata("import", folder, "--dataset", "e", *TABLE)[0] == 0
    assert [row["sample"] for row in rows().values()] == numbers


def test_labels_that_look_the_same_are_the_same(ajgdata, folder, rows):
    decomposed = unicodedata.normalize("NFD", "größe")
    labels = ["metal", "metal\u200b", "metal\u00a0", "gr\u00f6\u00dfe", decomposed, "a  b", "a b"]
    cells = "".join(f"w{number},{label}\n" for number, label in enumerate(labels))
    write_table(folder, "name,form\n" + cells, count=len(labels))
    code, out, _ = ajgdata("import", folder, "--dataset", "e", *TABLE)
    assert code == 0
    assert {row["form"] for row in rows().values()} == {"metal", "größe", "a b"}
    assert "note form: invisible characters or irregular spaces were removed from 3 cells: " in out
    assert r"'metal\u200b', 'gro\u0308\xdfe', 'a  b'" in out
    assert "note target form: a class (3 distinct texts)" in out


def test_a_project_inside_the_folder_is_not_imported(ajgdata, project):
    write(project.root / "metal", "1.wav", "2.wav")
    write(project.root / "wood", "1.wav", "2.wav")
    command = ("import", ".", "--dataset", "e", "--pattern", r"(?:.*/)?(?P<label>[^/]+)/(\w+)\.wav")
    code, out, _ = ajgdata(*command)
    assert (code, out.splitlines()[0]) == (
        0,
        "4 added, 0 changed, 0 unchanged in 1 session(s) of e",
    )
    write(project.paths.results / "x", "3.wav")
    write(project.paths.cache / "x", "4.wav")
    code, out, _ = ajgdata(*command)
    assert out.splitlines()[0] == "0 added, 0 changed, 4 unchanged in 1 session(s) of e"
    for own in (".ajgdata", "data", "results"):
        assert f"not used {own}: recordings or results of a project: not searched" in out
    code, _, error = ajgdata("import", "data", "--dataset", "f")
    assert code == 1
    assert "none of its audio files can be imported" in error


def test_hidden_recordings_are_reported(ajgdata, folder):
    write(folder, "metal/1.wav", ".wood/1.wav", "glass/.2.wav", "metal/._1.wav", ".bak/x/1.wav")
    code, out, _ = ajgdata(
        "import", folder, "--dataset", "e", "--pattern", r"(?P<label>[^/]+)/(?P<n>.*)\.wav"
    )
    assert code == 3
    assert "1 added" in out
    for name in (".wood/1.wav", "glass/.2.wav"):
        assert f"skipped {name}: hidden: rename the file or its folder" in out
    assert "not used metal/._1.wav: an AppleDouble file of macOS" in out
    code, out, _ = ajgdata("validate", folder, "--notes")
    assert code == 1
    levels = {
        line.split()[0]: line.split()[1] for line in out.splitlines() if "not_searched" in line
    }
    assert levels == {
        "recordings/.wood/1.wav": "warning",
        "recordings/glass/.2.wav": "warning",
        "recordings/.bak/x/1.wav": "warning",
        "recordings/metal/._1.wav": "note",
        "not_searched": "4,",  # the last line counts
    }


def test_one_class_is_no_task(ajgdata, project, folder):
    write(folder, "1_metal.wav", "2_metal.wav")
    code, out, _ = ajgdata("import", folder, "--dataset", "e")
    assert code == 0
    assert "warning task label is not possible: 'metal' is its only class; record or import" in out
    assert "ajgdata run" not in out
    declared = yaml.safe_load(project.paths.dataset("e").read_text())
    declared["features"] = {"window": 256, "hop": 64}
    project.paths.dataset("e").write_text(yaml.safe_dump(declared))
    code, out, _ = ajgdata("validate", "e")
    assert code == 1
    assert "task label is not possible: 'metal' is its only class" in out
    write(folder, "1_metal.wav", "2_metal.wav", "3_wood.wav")
    code, out, _ = ajgdata("import", folder, "--dataset", "e")
    assert "not possible" not in out
    assert "next: ajgdata validate e, then ajgdata run e" in out
    assert ajgdata("validate", "e")[0] == 0


@pytest.mark.parametrize(
    ("table", "text"),
    [
        ("", "t.csv: is empty; write a line with column names and a line per file"),
        ("\n \n", "t.csv: is empty"),
        ("name,form\n", "t.csv: has column names but no rows; write a line with"),
        (
            "sep=;\nname;form\nw0;pl;x\n",
            "t.csv: is not a valid table (Expected 2 fields in line 2, saw 3)",
        ),
        ("name;;form\nw0;pl;x\n", "t.csv: column 2 has no name; name it"),
    ],
)
def test_a_table_that_cannot_be_read_is_one_line(ajgdata, folder, table, text):
    write_table(folder, table)
    code, _, error = ajgdata("import", folder, "--dataset", "e", *TABLE)
    assert code == 1
    assert_one_line(error, text)


@pytest.mark.parametrize(
    "table",
    [
        "sep=;\nname;form\nw0;pl\nw1;pt\n",
        '"sep=;"\nname;form\nw0;pl\nw1;pt\n',
        "SEP=,\nname,form\nw0,pl\nw1,pt\n",
        "name;form;\nw0;pl;\nw1;pt;\n",
        "name,form,,\nw0,pl\nw1,pt,,\n",
        "name\tform\t\nw0\tpl\t\nw1\tpt\t\n",
    ],
)
def test_tables_as_spreadsheets_save_them(ajgdata, folder, rows, table):
    write_table(folder, table, count=2)
    assert ajgdata("import", folder, "--dataset", "e", *TABLE)[0] == 0
    assert {name: row["form"] for name, row in rows().items()} == {"w0": "pl", "w1": "pt"}
    assert list(rows()["w0"])[-2:] == ["form", "name"]


def test_a_copy_in_another_format_is_named_as_such(ajgdata, folder):
    write(folder, "Wood/1.wav", "Metal/1.wav")
    (folder / "Wood" / "1.m4a").write_bytes(b"....ftypM4A ")
    (folder / "Wood" / "2.m4a").write_bytes(b"....ftypM4A ")
    pattern = ("--pattern", r"(?P<label>\w+)/(?P<n>\d+)\.wav")
    code, out, _ = ajgdata("import", folder, "--dataset", "e", *pattern)
    assert code == 0
    reason = "probably the same sound as the WAV, FLAC or Ogg file with the same name"
    assert f"not used Wood/1.m4a: {reason}" in out
    assert "not used Wood/2.m4a: does not match the pattern" in out


def test_a_name_too_long_for_a_file_is_one_line(ajgdata, project, folder):
    write(folder, "1_a.wav", "2_b.wav")
    code, _, error = ajgdata("import", folder, "--dataset", "x" * 300)
    assert code == 1
    assert_one_line(error, "up to 100 characters")
    assert len(error) < 200
    assert not project.paths.data.exists()
    for command in ("validate", "info", "seal", "run"):
        code, _, error = ajgdata(command, "x" * 300)
        assert code == 1
        assert_one_line(error, "up to 100 characters")
    assert ajgdata("import", folder, "--dataset", "e", "--session", "y" * 300)[0] == 0
    session = next(project.paths.sessions("e").iterdir()).name
    assert session.startswith("y" * 80)
    assert len(session) == 100
    table = f"name,{'z' * 300}\n1_a,p\n2_b,q\n"
    (folder / "t.csv").write_text(table)
    options = ("--table", "t.csv", "--file", "{name}.wav", "--target", "z")
    code, _, error = ajgdata("import", folder, "--dataset", "f", *options)
    assert code == 1
    assert_one_line(error, "has a name of 300 characters; use up to 100")
