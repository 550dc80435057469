"""A guided session with a real card's stand-in: what is kept, redone, refused, and named."""

import io
import sys
from contextlib import nullcontext

import numpy as np
import pandas as pd
import pytest
import yaml
from fake_card import FakeLine, Fault
from live_lab import Lab, Scripted, declare, response
from rich.console import Console

from ajgdata.acquire.card import CardError
from ajgdata.acquire.operator import Choice, OperatorDecision, Unattended
from ajgdata.acquire.protocol import whole_grasps
from ajgdata.acquire.robot import RobotError
from ajgdata.paths import Paths
from ajgdata.pipeline.validate import validate_dataset
from ajgdata.store.audio import read_audio
from ajgdata.store.sessions import read_recordings, read_session
from ajgdata.types import AudioSettings, DataError

ALL = ["cube_01", "ball_01", "cube_02", "ball_02"]


@pytest.fixture
def lab(tmp_path, monkeypatch):
    paths = Paths(tmp_path / "project")
    declare(paths)
    return Lab(paths, monkeypatch)


def rows(lab, session="soundcard-01"):
    recordings, findings = read_recordings(lab.folder(session))
    assert findings == []
    return recordings


def qualities(lab):
    return {r.recording_id: r.quality for r in rows(lab)}


def problems(lab):
    """Errors and warnings of validate."""
    _, issues = validate_dataset(lab.paths, "d")
    return [issue for issue in issues if issue.level != "note"]


def files(lab):
    return {p.name: p.read_bytes() for p in (lab.folder() / "audio").iterdir()}


def test_what_a_session_holds(lab):
    name, done = lab.acquire(operator := Scripted())
    assert (name, done.recorded, done.left, done.skipped) == ("soundcard-01", 8, 0, {})
    assert operator.announced == [(name, at, 4) for at, name in enumerate(ALL)]
    assert len(operator.calls) == 4 and "press it on cube with 8 N" in operator.calls[0]
    held = rows(lab)
    assert [r.recording_id for r in held] == sorted(f"{g}_{n}" for g in ALL for n in (1, 2))
    row = held[0]
    assert (row.grasp_id, row.sample, row.object, row.quality) == ("ball_01", 0, "ball", "ok")
    assert row.labels["label"] == "ball"
    assert (row.labels["planned"], row.labels["grasp_attempt"]) == ("ball_01", "1")
    latency = int(row.labels["latency_samples"])
    assert 1_024 <= latency < 1_024 + len(response()) and row.labels["xruns"] == "0"
    file = lab.folder() / "session.yaml"
    assert file.read_text(encoding="utf-8").startswith("format: 1\n")
    session = read_session(lab.folder())
    assert (session.source, session.gripper, session.medium) == ("soundcard", "mine", "rice")
    assert (session.device, session.sample_rate_hz) == ("fake", 44_100)
    about = session.acquisition
    assert about.finished and about.latency_samples == latency
    assert about.driver == {"api": "fake"}
    assert about.setup["protocol"]["force_n"] == 8
    assert about.level_dbfs == pytest.approx(20 * np.log10(0.9), abs=0.01)
    assert session.excitation.settings["length_s"] == 0.2
    assert problems(lab) == []


def test_what_is_written_is_what_the_plant_answers(lab):
    lab.lines = [FakeLine(response(), latency=1_500)]
    lab.acquire(Scripted())
    audio = AudioSettings()
    played = read_audio(lab.folder() / "excitation.wav", audio).samples
    wanted = np.convolve(played, response())[: len(played)]
    samples = read_audio(lab.folder() / rows(lab)[0].file, audio).samples
    # The strongest of the response's first samples is where the marker says the sound arrives.
    shift = int(rows(lab)[0].labels["latency_samples"]) - 1_500
    assert 0 <= shift < 64
    kept = slice(0, len(wanted) - shift)
    # Half a 24-bit code, and the stand-in's FFT in float32: 1e-7 times log2 of its 16,384 values.
    np.testing.assert_allclose(samples[kept], wanted[shift:], rtol=0, atol=2**-24 + 14e-7)


def test_quit_and_go_on(lab):
    _, done = lab.acquire(Scripted(confirms={0: Choice.QUIT}))
    assert (done.recorded, done.left, lab.folder().exists()) == (0, 4, False)
    _, done = lab.acquire(Scripted(confirms={2: Choice.QUIT}))
    assert (done.recorded, done.left) == (4, 2)
    assert read_session(lab.folder()).acquisition.finished
    assert problems(lab) == []
    before = files(lab)
    name, done = lab.acquire(operator := Scripted())
    assert (name, done.recorded, done.left) == ("soundcard-01", 4, 0)
    assert operator.announced[0] == (ALL[2], 2, 4)
    assert before.items() <= files(lab).items()
    assert set(qualities(lab).values()) == {"ok"}


def test_a_grasp_is_skipped_and_stays_skipped(lab):
    _, done = lab.acquire(Scripted(confirms={1: Choice.SKIP}))
    assert (done.recorded, done.left, list(done.skipped)) == (6, 0, ["ball_01"])
    assert [p.code for p in problems(lab)] == ["skipped"]
    assert "skipped by the operator" in done.skipped["ball_01"]
    assert lab.acquire(Scripted(), session="soundcard-01")[1].recorded == 0


def test_what_stays_in_doubt_is_never_stored(lab):
    faults = [Fault(), *[Fault(delete=64, at=5_000)] * 3]
    lab.lines = [FakeLine(response(), noise=1e-4, faults=faults)]
    lab.acquire(operator := Scripted(decisions=[Choice.REDO]))
    ((problem, choices),) = operator.problems
    assert "3 takes of 3 in doubt: 64 frames" in problem and Choice.KEEP not in choices
    assert qualities(lab)["cube_01_1"] == "reject"  # whole or redone
    assert [r.grasp_id for r in whole_grasps(rows(lab))["cube_01"]] == ["cube_01-2"] * 2
    assert problems(lab) == []


KEPT = "recordings are kept: run the same command again to resume"


class OneTake(FakeLine):
    """A line that is killed with its child when it is unplugged: nothing can be redone."""

    def play(self, sound, frames):
        if self.takes > 2:
            raise CardError("fake", "its process has ended", "start again")
        return super().play(sound, frames)


def test_a_card_that_is_gone_ends_the_run_and_no_grasp_is_left_out_for_it(lab):
    lab.lines = [OneTake(response(), noise=1e-4, faults=[Fault()] * 3 + [Fault(unplugged=True)])]
    gone = f"fake: its process has ended. Start again; {KEPT}."
    with pytest.raises(CardError) as error:
        lab.acquire(operator := Scripted())
    assert (str(error.value), operator.problems) == (gone, [])
    assert qualities(lab) == dict.fromkeys(["cube_01_1", "cube_01_2"], "ok") | {
        "ball_01_1": "reject"
    }
    assert problems(lab) == []
    _, done = lab.acquire(Scripted())
    assert (done.recorded, done.left, done.skipped) == (6, 0, {})


def test_clipping_is_counted_marked_and_offered(lab):
    lab.lines = [FakeLine(response(), noise=1e-4, faults=[Fault(gain=30.0)] * 2)]
    lab.acquire(operator := Scripted(decisions=[Choice.KEEP]))
    assert "clipped" in operator.problems[0][0]
    assert [qualities(lab)[f"cube_01_{n}"] for n in (1, 2)] == ["clipped", "clipped"]
    assert int(rows(lab)[4].labels["clipped"]) > 100 and rows(lab)[4].recording_id == "cube_01_1"
    assert {p.code for p in problems(lab)} == {"clipped", "level_jump"}


def test_nobody_is_there(lab):
    faults = [*[Fault(delete=64, at=5_000)] * 3, Fault(gain=30.0)]
    lab.lines = [FakeLine(response(), noise=1e-4, faults=faults)]
    declare(lab.paths, robot={"command": ["true"]})
    console = Console(file=io.StringIO(), width=200)
    _, done = lab.acquire(Unattended(console))
    assert list(done.skipped) == ["cube_01"]  # after three takes
    assert "64 frames lost" in done.skipped["cube_01"]
    lines = [text for text in console.file.getvalue().splitlines() if "; " in text]
    choices = [text.rpartition("; ")[2] for text in lines]
    assert choices == ["skip", "keep"]  # the second is clipped
    assert "64 frames lost" in lines[0]
    assert qualities(lab)["ball_01_1"] == "clipped"
    assert (done.recorded, done.left) == (6, 0)


class HummingLine(FakeLine):
    """A line with mains hum of 50 Hz and an offset, as a cheap sound card has them."""

    rate_hz = 44_100

    def play(self, sound, frames):
        recorded, flags = super().play(sound, frames)
        time_s = np.arange(frames) / self.rate_hz
        lines = [np.sin(2 * np.pi * 50 * number * time_s + number) for number in (1, 2, 3)]
        return (recorded + 0.02 * np.sum(lines, axis=0) + 0.05).astype(np.float32), flags


#: Hum is steady only if it lasts longer than the low frequencies of the sweep.
LONGER = {"kind": "log_sweep", "length_s": 0.5}


def add_settings(lab, **settings):
    """Change keys of the declaration of the data set."""
    path = lab.paths.dataset("d")
    path.write_text(yaml.safe_dump(yaml.safe_load(path.read_text()) | settings))


def test_a_robot_keeps_recordings_with_warnings_and_their_doubt(lab):
    lab.lines = [HummingLine(response(), noise=1e-4)]
    declare(lab.paths, robot={"command": ["true"]}, samples_per_grasp=1)
    add_settings(lab, excitation=LONGER)
    _, done = lab.acquire(Unattended(Console(file=io.StringIO())))
    assert (done.recorded, done.left, done.skipped) == (4, 0, {})
    assert set(qualities(lab).values()) == {"ok"}
    for row in rows(lab):
        assert "mains hum of 50 Hz" in row.labels["doubt"]
        assert "constant offset" in row.labels["doubt"]
    assert {problem.code for problem in problems(lab)} == {"hum", "offset"}


@pytest.mark.parametrize(("rate_hz", "band_hz"), [(44_100, [500, 20_000]), (96_000, None)])
def test_an_acquisition_checks_the_bins_of_the_feature_at_the_rate_of_the_card(
    lab, rate_hz, band_hz
):
    """With the band that the message proposes there is no doubt; hum is found at any rate."""
    features = {"band_hz": band_hz}
    add_settings(lab, excitation=LONGER, features=features, audio={"sample_rate_hz": rate_hz})
    line = HummingLine(response(), noise=1e-4)
    line.rate_hz = rate_hz
    lab.lines = [line]
    lab.acquire(operator := Scripted(decisions=[Choice.KEEP] * 4))
    texts = [text for text, _ in operator.problems]
    assert len(texts) == (0 if band_hz else 4)
    assert all("mains hum of 50 Hz" in text for text in texts)


@pytest.mark.parametrize("ends", [Choice.QUIT, KeyboardInterrupt()])
def test_who_ends_it_at_a_question_leaves_no_half_grasp(lab, ends):
    class Leaves(Scripted):
        def decide(self, problem, choices):
            if isinstance(ends, Choice):
                raise OperatorDecision(ends)  # the terminal is gone
            raise ends

    lab.lines = [FakeLine(response(), noise=1e-4, faults=[Fault(), *[Fault(nan=True)] * 3])]
    ended = nullcontext() if isinstance(ends, Choice) else pytest.raises(KeyboardInterrupt)
    with ended:
        lab.acquire(Leaves())
    assert qualities(lab) == {"cube_01_1": "reject"}
    assert read_session(lab.folder()).acquisition.finished


def test_targets_without_a_value_are_columns_to_fill_in(lab):
    declare(lab.paths, grasps_per_object=1)
    lab.acquire(Scripted(confirms={1: Choice.QUIT}))
    path = lab.folder() / "recordings.csv"
    table = pd.read_csv(path, dtype=str, keep_default_na=False)
    assert list(table["mass_g"]) == ["", ""] and list(table["label"]) == ["cube", "cube"]
    table.assign(mass_g="7.25").to_csv(path, index=False)
    lab.acquire(Scripted())
    assert [r.labels["mass_g"] for r in rows(lab)] == ["", "", "7.25", "7.25"]


def test_without_a_person_a_robot_is_needed(lab):
    with pytest.raises(DataError, match="a person must move the gripper"):
        lab.acquire(Unattended(Console(file=io.StringIO())))


def test_references_are_recorded_without_labels(lab):
    declare(lab.paths, references={"every": 2}, samples_per_grasp=1)
    _, done = lab.acquire(Scripted())
    assert (done.recorded, done.left) == (6, 0)
    empty = [r for r in rows(lab) if r.labels["reference"] == "empty"]
    assert {row.placement_id for row in empty} == {""}
    held = [row for row in rows(lab) if row.object]
    assert [row.placement_id for row in held] == [row.labels["planned"] for row in held]
    assert [(r.grasp_id, r.quality) for r in empty] == [("empty_01", "ok"), ("empty_02", "ok")]
    assert {(r.object, r.labels["label"]) for r in empty} == {("", "")}
    assert problems(lab) == []
    assert lab.acquire(Scripted(), session="soundcard-01")[1].recorded == 0


def test_another_setup_and_a_wrong_name_are_refused(lab):
    lab.acquire(Scripted(confirms={1: Choice.QUIT}))
    before = files(lab), (lab.folder() / "session.yaml").read_bytes()
    declare(lab.paths, force_n=5.0)
    with pytest.raises(DataError, match=r"another setup: protocol\. .*into another --session\.$"):
        lab.acquire(Scripted(), session="soundcard-01")
    assert (files(lab), (lab.folder() / "session.yaml").read_bytes()) == before
    with pytest.raises(DataError, match="is not a valid name of a session"):
        lab.acquire(Scripted(), session="../up")


def test_a_session_of_an_older_version_is_resumed_with_its_input_channel(lab):
    """Its setup has the key `input_channel`, which is now `microphone`."""
    lab.acquire(Scripted(confirms={3: Choice.QUIT}))
    session = lab.folder() / "session.yaml"
    assert "    microphone: 1\n" in session.read_text()
    session.write_text(session.read_text().replace("    microphone: 1\n", "    input_channel: 1\n"))
    assert lab.acquire(Scripted(), session="soundcard-01")[1].left == 0
    session.write_text(session.read_text().replace("input_channel: 1\n", "input_channel: 2\n"))
    with pytest.raises(DataError, match=r"another setup: device\."):
        lab.acquire(Scripted(), session="soundcard-01")


def test_the_table_may_be_edited_during_a_session_and_a_wrong_one_is_not_overwritten(lab):
    table = lab.folder() / "recordings.csv"

    class Editor(Scripted):
        def confirm(self, text):
            super().confirm(text)
            if len(self.calls) == 3:
                table.write_text(table.read_text().replace("ball,ok", "ball,clipped"))

    lab.acquire(Editor(confirms={3: Choice.QUIT}))
    assert qualities(lab)["ball_01_1"] == "clipped" and qualities(lab)["cube_02_2"] == "ok"
    table.write_text(table.read_text().replace("cube_01_2,", "cube_01_1,"))
    before = table.read_bytes()
    with pytest.raises(DataError, match="2 rows share this recording_id"):
        lab.acquire(Scripted())
    assert table.read_bytes() == before


FAILING = """
import json, pathlib, sys
asked = json.load(sys.stdin)
count = pathlib.Path(sys.argv[1])
number = int(count.read_text()) + 1 if count.exists() else 1
count.write_text(str(number))
if asked["step"] == sys.argv[2] and number == int(sys.argv[3]):
    sys.exit("pressure lost")
if asked["step"] == "approach":
    print(json.dumps({"force_n": 7.9, "joints_rad": [0.5, number]}))
"""


def failing_robot(lab, tmp_path, step, at):
    program = tmp_path / "robot.py"
    program.write_text(FAILING)
    command = [sys.executable, str(program), str(tmp_path / "count"), step, str(at)]
    declare(lab.paths, robot={"command": command}, samples_per_grasp=1, grasps_per_object=1)


def test_a_person_decides_about_a_robot_that_fails(lab, tmp_path):
    failing_robot(lab, tmp_path, "approach", 2)
    _, done = lab.acquire(operator := Scripted(decisions=[Choice.REDO]))
    ((problem, choices),) = operator.problems
    assert "pressure lost" in problem and Choice.KEEP not in choices
    assert done.recorded == 2 and set(qualities(lab).values()) == {"ok"}


def test_settings_of_a_robot_stay_at_home_and_may_change(lab, tmp_path):
    failing_robot(lab, tmp_path, "approach", 8)  # of six calls a grasp, the second of the second
    with pytest.raises(RobotError, match=r"approach: .*pressure lost"):
        lab.acquire(Unattended(Console(file=io.StringIO())))
    assert qualities(lab) == {"cube_01_1": "ok"}
    labels = rows(lab)[0].labels
    assert labels["force_reached_n"] == labels["robot_force_n"] == "7.9"
    assert labels["robot_joints_rad_1"] == "0.5" and labels["robot_joints_rad_2"] == "2.0"
    assert str(tmp_path) not in (lab.folder() / "session.yaml").read_text()
    failing_robot(lab, tmp_path, "approach", 99)
    _, done = lab.acquire(Unattended(Console(file=io.StringIO())))
    assert (done.recorded, done.left) == (1, 0)


MEASURING = """
import json, sys
asked = json.load(sys.stdin)
if asked["step"] == "approach" and asked["number"] == 1:
    print(json.dumps({"place": 7, "xy_m": [0.25, -0.5]}))
"""


def test_numbers_of_the_robot_can_be_targets_and_a_missing_one_is_empty(lab, tmp_path):
    program = tmp_path / "robot.py"
    program.write_text(MEASURING)
    declare(lab.paths, robot={"command": [sys.executable, str(program)]}, samples_per_grasp=1)
    path = lab.paths.dataset("d")
    declared = yaml.safe_load(path.read_text())
    columns = ["robot_xy_m_1", "robot_xy_m_2"]
    declared["targets"]["xy"] = {"kind": "regression", "columns": columns, "unit": "m"}
    declared["tasks"] = {"xy": {"target": "xy", "groups": "robot_place"}}
    path.write_text(yaml.safe_dump(declared))
    lab.acquire(Scripted())
    cells = {
        row.recording_id: [row.labels.get(name) for name in (*columns, "robot_place")]
        for row in rows(lab)
    }
    assert cells["cube_01_1"] == ["0.25", "-0.5", "7.0"]
    assert cells["cube_02_1"] == ["", "", ""]
