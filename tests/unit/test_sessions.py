"""dataset.yaml, session.yaml, recordings.csv: each mistake gives one line that says what to do."""

import re
from pathlib import Path

import pytest
import yaml

from ajgdata.store.sessions import (
    audio_path,
    list_sessions,
    read_dataset,
    read_recordings,
    read_session,
    write_recordings,
)
from ajgdata.types import DataError, Recording, Session

RECIPE = {
    "grasps_per_object": 1,
    "objects": [{"name": "x", "shape": {"kind": "cube"}, "targets": {"edge_mm": 1}}],
}


def recipe(**keys):
    return {"recipe": RECIPE | keys}


def embedding(**keys):
    """Return a declaration of the embedding `e`; the data set has the target `edge_mm`."""
    settings = {"supervision": "Which objects are equal.", "target": "edge_mm"}
    return {"embeddings": {"e": settings | keys}}


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"colour": "red"}, "unknown key colour. Correct its spelling or remove it"),
        ({"name": "other"}, "name = 'other'. Use its folder's name, 'd'"),
        ({"name": "a b"}, "name = 'a b': Names are letters, digits, _ and -"),
        ({"features": {"hop": 4096}}, "hop 4096 exceeds window 2048"),
        ({"features": {"band_hz": [5, 1]}}, "must be 0 <= low < high"),
        ({"features": {"band_hz": [30000, 40000]}}, "holds no bin"),
        ({"audio": {"sample_rate_hz": 0, "other_rate": "x"}}, "(and 1 more)"),
        ({"targets": {"e": {"unit": "mm"}}}, "targets.e.kind is missing. Add targets.e.kind"),
        ({"targets": {"file": {"kind": "regression"}}}, "target file has the name of a standard"),
        ({"tasks": {"t": {"target": "nope"}}}, "task t: target 'nope' is not among the targets"),
        (embedding(target="nope"), "embedding e: 'nope' is not among the targets"),
        (embedding(), "embedding e: 'edge_mm' is a number, not a class"),
        (
            {"imports": {"pattern": "starter-kit", "table": "y", "file": "z"}},
            "pattern starter-kit and table exclude each other",
        ),
        (recipe(objects=RECIPE["objects"] * 2), "lists one twice"),
        (recipe(scene={"grasp": 3}), "scene.grasp must hold keys"),
        ({**recipe(), "targets": {}}, "object x: unknown targets ['edge_mm']"),
    ],
)
def test_mistakes_in_dataset_yaml(project, keys, said):
    path = project.declare(**keys)
    with pytest.raises(DataError) as caught:
        read_dataset(project.paths, "d")
    text = str(caught.value)
    assert re.match(rf"{re.escape(str(path))}:\d+: ", text)
    assert said in text
    assert "\n" not in text
    assert len(text) < 500


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"session_id": "s2"}, "session_id = 's2'. Use its folder's, 's1'"),
        ({"excitation": {"file": "x.wav"}}, "excitation.sha256 is missing"),
    ],
)
def test_mistakes_in_session_yaml(tmp_path, keys, said):
    folder = tmp_path / "s1"
    folder.mkdir()
    content = {"session_id": "s1", "source": "import"} | keys
    (folder / "session.yaml").write_text(yaml.safe_dump(content))
    with pytest.raises(DataError) as caught:
        read_session(folder)
    assert str(caught.value).startswith(f"{folder / 'session.yaml'}:")
    assert said in str(caught.value)


def table(folder: Path, text: str | bytes) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    content = text if isinstance(text, bytes) else text.encode()
    (folder / "recordings.csv").write_bytes(content)
    return folder


def test_rows_and_missing_values(tmp_path):
    folder = table(
        tmp_path / "s1",
        "\ufeffrecording_id,file,grasp_id,edge_mm,note,sample\r\n"
        "b,audio/b.wav,g,,,\r\n"
        'a,audio/a.wav,g,10.5,"schön, ja",3\r\n',
    )
    recordings, findings = read_recordings(folder)
    assert findings == []
    assert [r.recording_id for r in recordings] == ["a", "b"]
    assert recordings[0].labels == {"edge_mm": "10.5", "note": "schön, ja"}
    assert recordings[1].labels == {"edge_mm": "", "note": ""}
    assert (recordings[0].sample, recordings[1].sample, recordings[1].quality) == (3, 0, "ok")


def test_a_bad_row_is_named_and_the_others_are_kept(tmp_path):
    folder = table(
        tmp_path / "s1",
        "recording_id,file,grasp_id,sample,sha256\n"
        "a,a.wav,g,0,\n"
        "\n"
        "b,b.wav,g,many,\n"
        ",c.wav,g,0,\n"
        "d,,g,0,\n"
        "f,f.wav,g,0,ABC\n"
        "g,g.wav,g,2147483648,\n"
        "h,1.wav,g,0,\n"
        "h,2.wav,g,0,\n",
    )
    recordings, findings = read_recordings(folder)
    assert [r.recording_id for r in recordings] == ["a"]
    problems = {f.problem: (f.recording_id, f.code) for f in findings}
    assert len(findings) == 7
    assert problems["2 rows share this recording_id"] == ("h", "duplicate_id")
    rows = {name: problem for problem, (name, code) in problems.items() if code == "bad_row"}
    # line numbers count the empty line, as every editor does
    assert rows["b"].startswith("recordings.csv row 4: sample = 'many': Input should be")
    assert rows["row 5"] == "recordings.csv row 5: recording_id is missing"
    assert rows["d"] == "recordings.csv row 6: file is missing"
    assert rows["f"].startswith("recordings.csv row 7: sha256 = 'ABC'")
    assert rows["g"].startswith("recordings.csv row 8: sample = '2147483648'")


@pytest.mark.parametrize(
    ("header", "said"),
    [
        ("recording_id,file", "needs grasp_id; its header is"),
        ("recording_id,file,grasp_id,source", "no label can have the name 'source'"),
    ],
)
def test_a_table_that_cannot_be_used(tmp_path, header, said):
    with pytest.raises(DataError, match=re.escape(said)):
        read_recordings(table(tmp_path / "s1", header + "\n"))


@pytest.mark.parametrize("file", ["/etc/passwd", "../x.wav", "link"])
def test_files_outside_are_refused(tmp_path, file):
    folder = tmp_path / "s1"
    folder.mkdir()
    (tmp_path / "x.wav").write_bytes(b"")
    (folder / "link").symlink_to(tmp_path / "x.wav")
    recording = Recording(recording_id="a", file=file, grasp_id="g")
    with pytest.raises(DataError, match="leaves its folder"):
        audio_path(folder, Session(session_id="s1", source="import"), recording)


def test_recordings_in_a_folder_named_by_its_parent(tmp_path):
    (tmp_path / "s1").mkdir()
    recording = Recording(recording_id="a", file="x.wav", grasp_id="g")
    root = f"{tmp_path}/s1/../recordings"
    session = Session(session_id="s1", source="import", audio_root=root)
    path = audio_path(tmp_path / "s1", session, recording)
    assert path.resolve() == tmp_path / "recordings" / "x.wav"


def test_session_folders(project):
    assert list_sessions(project.paths, "d") == []
    for name in ("b", "a-1", ".trash"):
        project.folder(name).mkdir(parents=True)
    (project.folder("b").parent / "notes.txt").write_text("")
    assert list_sessions(project.paths, "d") == ["a-1", "b"]
    project.folder("day 1").mkdir()
    with pytest.raises(DataError, match=r"day 1: a session cannot have this name. Rename it"):
        list_sessions(project.paths, "d")


def test_unknown_placements_have_no_column_and_known_ones_come_back(tmp_path):
    rows = [Recording(recording_id=name, file=f"{name}.wav", grasp_id=name) for name in "ab"]
    write_recordings(tmp_path, rows)
    assert "placement_id" not in (tmp_path / "recordings.csv").read_text()
    placed = [rows[0].model_copy(update={"placement_id": "cube 1"}), rows[1]]
    write_recordings(tmp_path, placed)
    assert read_recordings(tmp_path) == (placed, [])
