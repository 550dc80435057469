"""Tables and data sets without recordings, and recordings that cannot be read, are reported."""

import pytest
from recorded import make_features
from sounds import resonances, write_wav

from ajgdata.pipeline.plan import plan
from ajgdata.pipeline.run_end import end_run
from ajgdata.pipeline.run_summary import complete
from ajgdata.store.files import csv_bytes, json_bytes, read_csv, write_bytes
from ajgdata.types import DataError


@pytest.fixture
def mine(ajgdata, src):
    """A data set of six recordings."""
    for number, label in enumerate(("cube", "ball")):
        for grasp in range(1, 4):
            write_wav(src / f"{grasp + 3 * number}_{label}.wav", resonances(number, grasp))
    assert ajgdata("import", src, "--dataset", "mine").code == 0


def test_a_table_with_a_header_only_fails_check(ajgdata, paths, mine):
    table = paths.recordings_file("mine", "src")
    table.write_text(table.read_text().splitlines()[0] + "\n")
    checked = ajgdata("check", "mine")
    assert checked.code == 3
    line = "error no_recordings src/*: recordings.csv has a header and no recordings; import or"
    assert line in checked.text
    assert "1 issue of sessions or the data set" in checked.text


def test_one_empty_table_among_sessions_fails_check(ajgdata, paths, mine):
    session = paths.session("mine", "day2")
    session.mkdir()
    header = paths.recordings_file("mine", "src").read_text().splitlines()[0]
    (session / "recordings.csv").write_text(f"{header}\n,,,,,,\n\n")  # as spreadsheets write it
    (session / "session.yaml").write_text("session_id: day2\nsource: import\n")
    checked = ajgdata("check")
    assert checked.code == 3
    assert "error no_recordings day2/*" in checked.text
    assert "1 issue of sessions or the data set" in checked.text


@pytest.mark.parametrize("folder", ["", "data/mine", "data/mine/sessions", "data/mine/sessions/.x"])
@pytest.mark.parametrize("arguments", [("mine",), ()])
def test_a_data_set_without_sessions_fails_check(ajgdata, paths, folder, arguments):
    (paths.root / folder).mkdir(parents=True, exist_ok=True)
    paths.dataset("mine").parent.mkdir()
    paths.dataset("mine").write_text("name: mine\n")
    checked = ajgdata("check", *arguments)
    assert checked.code == 3
    line = "error no_sessions */*: there are no sessions; get some with `ajgdata import FOLDER"
    assert line in checked.text
    assert "1 issue of sessions or the data set" in checked.text


def test_a_recipe_and_public_recordings_need_no_session_yet(ajgdata, paths):
    for name in ("simulated", "public"):
        paths.dataset(name).parent.mkdir()
    recipe = "recipe:\n  grasps_per_object: 2\n  objects:\n"
    recipe += "    - {name: cube, shape: {kind: cube, edge_mm: 20}}\n"
    paths.dataset("simulated").write_text(f"name: simulated\n{recipe}")
    paths.dataset("public").write_text("name: public\n")
    paths.source("public").write_text("")
    everything = ajgdata("check")
    assert everything.code == 0
    assert "not fetched, so not checked: public" in everything.text
    named = ajgdata("check", "public")
    assert named.code == 3
    assert "get some with `ajgdata fetch public`" in named.text
    with pytest.raises(DataError, match=r"holds no sessions. Get some with `ajgdata fetch public`"):
        plan(paths, ["public"])


def run(paths) -> str:
    """Compute the features and end the run; returns the text of its summary."""
    make_features(paths, "mine")
    about = {
        "measurements": [],
        "agreements": {},
        "answer": [],
        "placebo": "",
        "cost": "",
        "unreadable": {},
    }
    write_bytes(paths.runs, json_bytes(about))
    complete(paths, ["mine"], [], [], [], [], paths.complete)
    return paths.complete.read_text()


DEFECTS = {
    "truncated": lambda path: path.write_bytes(path.read_bytes()[:-500]),
    "damaged": lambda path: path.write_text("no sound"),
    "empty": lambda path: path.write_bytes(b""),
    "missing": lambda path: path.unlink(),
    "no_samples": lambda path: write_wav(path, resonances(0, 1)[:0]),
    "changed": lambda path: write_wav(path, resonances(4, 4)),
}


@pytest.fixture(autouse=True)
def known_machine(monkeypatch):
    monkeypatch.setattr("ajgdata.pipeline.run_summary.machine_line", lambda: "machine: fast")


@pytest.mark.parametrize("code", DEFECTS)
def test_an_unreadable_recording_is_named_and_ends_the_run_with_exit_code_1(
    paths, mine, ajgdata, capsys, code
):
    DEFECTS[code](paths.session("mine", "src") / "audio" / "2_cube.wav")
    if code not in ("missing", "changed"):  # the sha256 would be the first problem
        edit(paths, "2_cube", sha256="")
    text = run(paths)
    assert f"unreadable mine/src/2_cube: {code}: " in text
    with pytest.raises(SystemExit) as ended:
        end_run({paths.complete: 0})
    assert ended.value.code.startswith("incomplete: 1 recording of mine could not be read, see ")
    line = ended.value.code
    assert f"see {paths.quarantine('mine')}; " in line
    assert line.endswith(", or set `quality` to `reject` in recordings.csv")
    assert ("--accept" in line) == (code == "changed")
    assert not paths.complete.exists()  # the next run reports it again
    assert "1 data set: 5 recordings used" in capsys.readouterr().out
    edit(paths, "2_cube", quality="reject")
    run(paths)
    end_run({paths.complete: 0})
    assert paths.complete.exists()


def edit(paths, name: str, **cells: str) -> None:
    """Change cells of a recording in recordings.csv."""
    table = paths.recordings_file("mine", "src")
    header, rows = read_csv(table)
    for row in rows:
        row.update(cells if row["recording_id"] == name else {})
    write_bytes(table, csv_bytes(header, rows))


def test_readable_recordings_with_issues_do_not_change_the_exit_code(paths, mine):
    audio = paths.session("mine", "src") / "audio"
    write_wav(audio / "1_cube.wav", 0 * resonances(0, 1))  # silent
    write_wav(audio / "2_cube.wav", resonances(0, 2)[:100])  # too short
    (audio / "3_cube.wav").write_bytes((audio / "4_ball.wav").read_bytes())  # a copy
    for name in ("1_cube", "2_cube", "3_cube"):
        edit(paths, name, sha256="")
    text = run(paths)
    assert "left out  4 recordings" in text
    assert "unreadable" not in text and "incomplete" not in text
    end_run({paths.complete: 0})


def test_an_unreadable_session_changes_the_exit_code(paths, mine):
    paths.session_file("mine", "src").write_text("session_id: [")
    assert "unreadable mine/src/*: bad_session: session.yaml: not valid YAML" in run(paths)
    with pytest.raises(SystemExit, match="1 session of mine could not be read"):
        end_run({paths.complete: 0})


def test_many_unreadable_recordings_are_counted(paths, mine):
    for path in (paths.session("mine", "src") / "audio").iterdir():
        path.unlink()
    text = run(paths)
    assert text.count("unreadable mine/src/") == 5
    assert "unreadable and 1 more of mine" in text
    assert "incomplete: 6 recordings of mine could not be read" in text
