"""Import: nothing is lost or altered, and a second import changes only what changed."""

import hashlib
import json

import jsonschema
import pytest
from worlds import write_tone

from ajgdata.paths import Paths
from ajgdata.pipeline.importing import import_folder
from ajgdata.store.files import read_yaml
from ajgdata.store.provenance import settings_digest
from ajgdata.store.session_audio import check_session
from ajgdata.store.sessions import (
    list_sessions,
    read_dataset,
    read_recordings,
    read_session,
    write_dataset,
    write_recordings,
    write_session,
)
from ajgdata.types import DataError, DatasetSpec, ImportSettings, Recording, Session

#: Session of the recordings that lie directly in the folder "My recordings".
KIT = "My_recordings"


@pytest.fixture
def paths(tmp_path):
    (tmp_path / "project" / "datasets").mkdir(parents=True)
    return Paths(tmp_path / "project")


@pytest.fixture
def kit(tmp_path):
    folder = tmp_path / "My recordings"
    for name, hz in {"0_sweep": 100, "1_no object": 200, "2_cube ä": 300, "3_cube ä": 400}.items():
        write_tone(folder / f"{name}.wav", hz)
    return folder


def rows(paths, session=KIT):
    return {r.recording_id: r for r in read_recordings(paths.session("d", session))[0]}


def run(paths, folder, **options):
    settings = options.pop("settings", None)
    return import_folder(paths, "d", folder, settings=settings, **options)[1]


def counts(result):
    return result.added, result.changed, result.unchanged, names(result, "kept")


def names(result, kind):
    return [name for name, _ in result.remarks[kind]]


def test_starter_kit_folder(paths, kit):
    spec, result = import_folder(paths, "d", kit, settings=None)
    assert counts(result) == (3, 0, 0, [])
    assert names(result, "not used") == ["0_sweep.wav"]
    assert spec == read_dataset(paths, "d")
    assert spec.targets["label"].kind == "classification"
    assert list(spec.tasks) == ["label"]
    session = read_session(paths.session("d", KIT))
    assert session.sample_rate_hz == 8000
    held = rows(paths)
    assert set(held) == {"1_no object", "2_cube ä", "3_cube ä"}
    assert held["2_cube ä"].labels == {"label": "cube ä", "n": "2"}
    for name, row in held.items():
        copied = paths.session("d", KIT) / row.file
        assert copied.read_bytes() == (kit / f"{name}.wav").read_bytes()
        assert row.sha256 == hashlib.sha256(copied.read_bytes()).hexdigest()


def test_a_new_data_set_names_its_schema_in_a_comment(paths, kit):
    spec, _ = import_folder(paths, "d", kit, settings=None)
    comment, _ = paths.dataset("d").read_text().split("\n", 1)
    schema = paths.dataset("d").parent / comment.removeprefix("# yaml-language-server: $schema=")
    jsonschema.validate(read_yaml(paths.dataset("d")), json.loads(schema.read_text()))
    without = paths.dataset("d").read_text().removeprefix(comment)
    paths.dataset("d").write_text(without)
    assert settings_digest(read_dataset(paths, "d")) == settings_digest(spec)


def test_again_changes_nothing(paths, kit, snapshot):
    run(paths, kit)
    before = {name: content for name, (content, _) in snapshot(paths.root).items()}
    assert counts(run(paths, kit)) == (0, 0, 3, [])
    assert {name: content for name, (content, _) in snapshot(paths.root).items()} == before


def test_changed_bytes_are_a_conflict_unless_replaced(paths, kit):
    run(paths, kit)
    before = rows(paths)["3_cube ä"]
    digest = write_tone(kit / "3_cube ä.wav", 999)
    assert counts(run(paths, kit)) == (0, 0, 2, ["3_cube ä"])
    assert rows(paths)["3_cube ä"] == before
    held = paths.session("d", KIT) / before.file
    assert hashlib.sha256(held.read_bytes()).hexdigest() == before.sha256
    assert counts(run(paths, kit, on_change="files")) == (0, 1, 2, [])
    assert rows(paths)["3_cube ä"].sha256 == digest
    assert held.read_bytes() == (kit / "3_cube ä.wav").read_bytes()


def test_reference_leaves_the_audio_where_it_is(paths, kit):
    run(paths, kit, copy=False)
    folder = paths.session("d", KIT)
    assert not (folder / "audio").exists()
    assert read_session(folder).audio_root == str(kit)
    session = check_session(folder)
    assert session.findings == []
    assert {file.path for file in session.files} == set(kit.glob("[1-9]*.wav"))
    assert counts(run(paths, kit, copy=False)) == (0, 0, 3, [])
    write_tone(kit / "1_no object.wav", 777)
    assert [f.code for f in check_session(folder).findings] == ["changed"]


def test_targets_are_declared_by_what_the_cells_hold(paths, tmp_path):
    folder = tmp_path / "stones"
    lines = ["name,mass (g),form,few"]
    for number in range(14):
        write_tone(folder / f"w{number}.wav", 200 + number)
        mass = "NaN" if number == 3 else str(100.5 + number)
        lines.append(f"w{number},{mass},{'ab'[number % 2]},{number % 3}")
    (folder / "t.csv").write_text("\n".join(lines))
    settings = ImportSettings(table="t.csv", file="{name}.wav")
    with pytest.raises(DataError, match=r"a table has many columns. Name labels among"):
        run(paths, folder, settings=settings)
    run(paths, folder, settings=settings, targets=["mass (g)", "form", "few"])
    targets = read_dataset(paths, "d").targets
    assert {name: t.kind for name, t in targets.items()} == {
        "mass_g": "regression",
        "form": "classification",
        "few": "classification",
    }
    assert targets["mass_g"].missing == ("NaN",)


def test_what_people_wrote_into_a_session_stays(paths, kit):
    run(paths, kit)
    folder = paths.session("d", KIT)
    session = read_session(folder).model_copy(update={"gripper": "G7", "notes": "in the kitchen"})
    write_session(folder, session, list(rows(paths).values()))
    shorter = ImportSettings(pattern=r"(?P<n>[1-9])_(?P<label>\w+).*\.wav", grasp="{label}")
    assert counts(run(paths, kit, settings=shorter, on_change="labels")) == (0, 3, 0, [])
    assert rows(paths)["3_cube ä"].labels == {"label": "cube", "n": "3"}
    assert rows(paths)["3_cube ä"].grasp_id == "cube"
    assert read_session(folder) == session


def test_recordings_do_not_go_into_a_simulated_data_set(paths, kit, snapshot):
    write_dataset(paths, DatasetSpec(name="d"))
    recording = Recording(recording_id="1", file="audio/1.wav", grasp_id="1")
    write_session(paths.session("d", "s1"), Session(session_id="s1", source="virtual"), [recording])
    before = snapshot(paths.root)
    with pytest.raises(DataError, match="session s1 is simulated, what is to be added is recorded"):
        run(paths, kit)
    assert snapshot(paths.root) == before


@pytest.fixture
def days(tmp_path):
    """Two days, each a session by its folder, two recordings each."""
    folder = tmp_path / "days"
    for number, name in enumerate(("mon/1_cube", "mon/2_ball", "tue/1_cube", "tue/2_ball")):
        write_tone(folder / f"{name}.wav", 200 + 50 * number)
    return folder


def correct(paths, session, name, **cells):
    held = rows(paths, session)
    own = {c: text for c, text in cells.items() if c in ("grasp_id", "quality", "object")}
    labels = {c: text for c, text in cells.items() if c not in own}
    row = held[name]
    held[name] = row.model_copy(update={**own, "labels": {**row.labels, **labels}})
    write_recordings(paths.session("d", session), list(held.values()))


def assert_all_in_tables(paths):
    for session in list_sessions(paths, "d"):
        folder = paths.session("d", session)
        there = {str(p.relative_to(folder)) for p in (folder / "audio").rglob("*") if p.is_file()}
        assert there == {row.file for row in read_recordings(folder)[0]}


def test_a_corrected_label_stays_and_is_named(paths, days):
    run(paths, days)
    correct(paths, "mon", "mon/2_ball", label="bowl", grasp_id="g7")
    result = run(paths, days)
    assert (result.changed, result.unchanged) == (0, 4)
    assert names(result, "label") == [
        "mon/2_ball: label 'bowl' here, 'ball' in the folder",
        "mon/2_ball: grasp_id 'g7' here, 'mon/2_ball' in the folder",
    ]
    row = rows(paths, "mon")["mon/2_ball"]
    assert (row.labels["label"], row.grasp_id) == ("bowl", "g7")
    result = run(paths, days, on_change="labels")
    assert (result.changed, names(result, "label")) == (1, [])
    row = rows(paths, "mon")["mon/2_ball"]
    assert (row.labels["label"], row.grasp_id) == ("ball", "mon/2_ball")


def test_a_moved_file_is_the_same_recording(paths, days):
    run(paths, days)
    correct(paths, "mon", "mon/2_ball", quality="reject", mass_g="12")
    before = rows(paths, "mon")["mon/2_ball"]
    (days / "mon" / "2_ball.wav").rename(days / "mon" / "2_bowl.wav")
    write_tone(days / "mon" / "2_ball.wav", 777)  # another recording under its old name
    result = run(paths, days)
    assert (result.added, result.unchanged, names(result, "gone"), names(result, "kept")) == (
        1,
        4,
        [],
        [],
    )
    assert names(result, "label")[0] == "mon/2_ball: label 'ball' here, 'bowl' in the folder"
    assert set(rows(paths, "mon")) == {"mon/1_cube", "mon/2_ball", "mon/2_ball_2"}
    run(paths, days, on_change="labels")
    after = rows(paths, "mon")["mon/2_ball"]
    assert after.labels == {"label": "bowl", "n": "2", "mass_g": "12"}
    assert (after.sha256, after.quality) == (before.sha256, "reject")
    assert_all_in_tables(paths)
    assert run(paths, days).unchanged == 5


@pytest.mark.parametrize("copy", [True, False])
def test_what_is_gone_is_named_and_removed_on_demand(paths, days, copy):
    run(paths, days, copy=copy)
    (days / "mon" / "1_cube.wav").unlink()
    result = run(paths, days, copy=copy)
    assert (names(result, "gone"), len(rows(paths, "mon"))) == (["mon/1_cube"], 2)
    result = run(paths, days, copy=copy, on_change="prune")
    assert (names(result, "gone"), result.removed) == ([], 1)
    assert set(rows(paths, "mon")) == {"mon/2_ball"}
    if copy:
        assert_all_in_tables(paths)
    assert names(run(paths, days, copy=copy), "gone") == []
