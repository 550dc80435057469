"""`ajgdata record --source virtual`: a protocol without a person, a gripper or a sound card."""

import pytest
import yaml
from live_lab import Lab, Scripted, declare

from ajgdata.acquire.virtual import VirtualTable
from ajgdata.paths import Paths
from ajgdata.pipeline.acquire_live import acquire_live
from ajgdata.store.audio import SIMULATED
from ajgdata.store.sessions import read_recordings, read_session
from ajgdata.types import DataError

BLOCK = {"name": "block", "targets": {"label": "block"}, "shape": {"kind": "cube", "edge_mm": 25}}
OBJECTS = [{"name": "padlock", "targets": {"label": "metal"}}, BLOCK]


@pytest.fixture
def paths(tmp_path) -> Paths:
    project = Paths(tmp_path / "project")
    declare(project, objects=OBJECTS)
    return project


def record(paths, session=""):
    return acquire_live(paths, "d", session, source="virtual", operator=Scripted())


def test_a_session_is_simulated_and_complete(paths):
    operator = Scripted()
    name, outcome = acquire_live(paths, "d", "", source="virtual", operator=operator)
    assert (name, outcome.recorded, outcome.left, outcome.skipped) == ("virtual-01", 8, 0, {})
    assert operator.calls == []  # nobody is asked to move the gripper
    folder = paths.session("d", name)
    session = read_session(folder)
    assert session.is_simulated and session.acquisition.finished
    rows, findings = read_recordings(folder)
    assert findings == []
    labels = {row.object: row.labels["label"] for row in rows}
    assert labels == {"padlock": "metal", "block": "block"}
    for row in rows:
        assert SIMULATED.encode() in (folder / row.file).read_bytes()
    assert len({row.sha256 for row in rows}) == 8
    assert record(paths)[0] == "virtual-02"
    second = read_recordings(paths.session("d", "virtual-02"))[0]
    assert not {row.sha256 for row in rows} & {row.sha256 for row in second}


def test_an_interrupted_session_is_resumed_without_repeating_a_sound(paths, monkeypatch):
    take = VirtualTable.take

    def interrupted(table, *arguments):
        if len(table_takes) == 3:
            raise KeyboardInterrupt
        table_takes.append(table)
        return take(table, *arguments)

    table_takes = []
    monkeypatch.setattr(VirtualTable, "take", interrupted)
    with pytest.raises(KeyboardInterrupt):
        record(paths)
    first = {row.sha256 for row in read_recordings(paths.session("d", "virtual-01"))[0]}
    assert len(first) == 3
    monkeypatch.undo()
    name, outcome = record(paths)
    assert (name, outcome.recorded, outcome.left) == ("virtual-01", 6, 0)
    rows = read_recordings(paths.session("d", name))[0]
    assert len({row.sha256 for row in rows}) == len(rows) == 9
    assert [row.quality for row in rows].count("reject") == 1  # half of a grasp


def test_simulated_and_recorded_sessions_are_never_in_one_data_set(paths, monkeypatch):
    record(paths)
    lab = Lab(paths, monkeypatch)
    with pytest.raises(DataError, match=r"virtual-01 is simulated, .* both in one data set"):
        lab.acquire(Scripted())
    other = Paths(paths.root.parent / "other")
    declare(other, objects=OBJECTS)
    Lab(other, monkeypatch).acquire(Scripted())
    # the shape is not a part of the setup of a sound card
    assert b"shape" not in (other.session("d", "soundcard-01") / "session.yaml").read_bytes()
    with pytest.raises(DataError, match="soundcard-01 is recorded: both in one data set"):
        record(other)


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        (
            {"protocol": {"objects": [{"name": "mug"}]}},
            r"no object 'mug'. Add its shape, .*padlock",
        ),
        ({"audio": {"sample_rate_hz": 48_000}}, "sample_rate_hz is not 44100"),
        (
            {"recipe": {"grasps_per_object": 1, "objects": [{"name": "a", "shape": "padlock"}]}},
            "has a recipe for the virtual gripper. Use `ajgdata simulate d`",
        ),
    ],
)
def test_what_the_virtual_gripper_cannot_record(paths, changes, problem):
    text = paths.dataset("d").read_text()
    content = yaml.safe_load(text) | changes
    paths.dataset("d").write_text(yaml.safe_dump(content))
    with pytest.raises(DataError, match=problem):
        record(paths)
    assert not paths.recordings("d").exists()


def test_the_command_says_that_the_session_is_simulated(ajgdata, project):
    declare(project.paths, objects=OBJECTS)
    for arguments, problem in (
        ((), "requires a device"),
        (("--source", "card"), "unknown value 'card'"),
        (("--source", "virtual", "--device", "x"), "only used with --source soundcard"),
    ):
        code, out, err = ajgdata("record", "d", *arguments)
        assert (code, out) == (1, "")
        assert problem in err
    code, out, err = ajgdata("record", "d", "--source", "virtual")
    assert (code, err) == (0, "")
    assert out.splitlines()[-1] == ("d/virtual-01 (simulated): 8 recorded, all grasps are recorded")
