"""Robots: the steps in their order, and programs that fail, hang or talk nonsense."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from ajgdata.acquire.robot import RobotError, RobotGrasp, grasp_once, make_robot
from ajgdata.acquire.signals import ended_by_signals
from ajgdata.types.protocol import PAPER_SEQUENCE, RobotProgram

PLACE = RobotGrasp("cube_01", "cube", 1, 8.0)


class Logging:
    def __init__(self, fails=""):
        self.steps = []
        self.fails = fails

    def move(self, step, **about):
        self.steps.append((step, about))
        if step == self.fails:
            raise RobotError(step, "stuck", "look")
        return {"force_n": 7.5} if step == "approach" else {}


def test_the_paper_s_sequence_senses_at_ambient_pressure():
    robot = Logging()
    measured = []

    def sense(numbers):
        robot.steps.append(("sense", {}))
        measured.append(numbers)

    grasp_once(robot, PLACE, PAPER_SEQUENCE, 2.0, sense)
    assert robot.steps == [
        ("loosen", {}),
        ("approach", vars(PLACE)),
        ("hold", {"seconds": 2.0}),
        ("sense", {}),
        ("jam", {}),
        ("lift", {}),
        ("release", {}),
    ]
    assert measured == [{"force_n": 7.5}]


PROGRAM = """
import json, pathlib, sys
asked = json.load(sys.stdin)
with open(sys.argv[1], "a") as log:
    log.write(json.dumps(asked) + "\\n")
if asked["step"] == "approach":
    force_n = asked["force_n"] - 0.25
    print(json.dumps({"force_n": force_n, "x_m": 0.25, "joints_rad": [1, -2.5]}))
"""


def command(tmp_path: Path, program: str = PROGRAM, **settings):
    file = tmp_path / "robot.py"
    file.write_text(program)
    called = [sys.executable, str(file), str(tmp_path / "log")]
    return make_robot(RobotProgram(command=called, **settings), print)


def test_a_program_gets_every_step(tmp_path):
    robot = command(tmp_path)
    measured = []
    grasp_once(robot, PLACE, PAPER_SEQUENCE, 1.5, measured.append)
    robot.move("place", bin="A")
    robot.move("halt", held="cube")
    assert measured == [{"force_n": 7.75, "x_m": 0.25, "joints_rad_1": 1.0, "joints_rad_2": -2.5}]
    steps = [json.loads(line) for line in (tmp_path / "log").read_text().splitlines()]
    assert [step["step"] for step in steps] == [
        "loosen",
        "approach",
        "hold",
        "jam",
        "lift",
        "release",
        "place",
        "halt",
    ]
    assert steps[1] == {
        "step": "approach",
        "grasp_id": "cube_01",
        "object": "cube",
        "number": 1,
        "force_n": 8.0,
    }
    assert (steps[2]["seconds"], steps[-2]["bin"], steps[-1]["held"]) == (1.5, "A", "cube")


def printing(text):
    return f"print({text!r})"


@pytest.mark.parametrize(
    "program, said",
    [
        ("import sys; sys.exit('no air pressure')", "failed with exit code 1: no air pressure"),
        ("print('done')", "printed 'done'"),
        ("print('[1, 2]')", r"printed '\[1, 2\]', which is not a JSON object"),
        (printing('{"force_n": "8 N"}'), 'printed force_n = "8 N", which is not a finite number'),
        (printing('{"force_n": NaN}'), "printed force_n = NaN, which is not a finite number"),
        (printing('{"x_m": 1e999}'), "printed x_m = Infinity, which is not a finite number"),
        (printing('{"is_on": true}'), "printed is_on = true, which is not a finite number"),
        (printing('{"q_rad": [0, null]}'), "printed q_rad_2 = null, which is not a finite number"),
        (printing('{"q_rad": [[1]]}'), r"printed q_rad_1 = \[1\], which is not a finite number"),
        (printing('{"x (m)": 1}'), r"printed 'x \(m\)', which cannot be the name of a column"),
        (printing('{"q": [1], "q_1": 2}'), "printed two numbers named 'q_1'"),
    ],
)
def test_a_program_that_fails_is_named(tmp_path, program, said):
    with pytest.raises(RobotError, match=said) as error:
        command(tmp_path, program).move("approach", **vars(PLACE))
    assert str(error.value).startswith("robot, approach: ")


HANGS = """
import pathlib, subprocess, sys, time
child = subprocess.Popen(["sleep", "600"])
pathlib.Path(sys.argv[1]).write_text(str(child.pid))
time.sleep(600)
"""


def test_a_program_that_hangs_is_ended_with_what_it_started(tmp_path):
    with pytest.raises(RobotError, match="was not finished after 1 s"):
        command(tmp_path, HANGS, timeout_s=1.0).move("jam")
    state = Path("/proc", (tmp_path / "log").read_text(), "stat")
    end = time.monotonic() + 60
    while state.exists() and state.read_text().split()[2] != "Z":
        assert time.monotonic() < end, "what the program started lives on"
        time.sleep(0.01)


@pytest.mark.skipif(sys.platform == "win32", reason="the program has no process group")
def test_a_signal_during_the_start_of_a_program_ends_the_program(monkeypatch):
    started = []

    class Signalled(subprocess.Popen):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            started.append(self)
            signal.raise_signal(signal.SIGTERM)

    monkeypatch.setattr(subprocess, "Popen", Signalled)
    robot = make_robot(RobotProgram(command=("sleep", "3000")), print)
    with pytest.raises(SystemExit) as ended, ended_by_signals():
        robot.move("jam")
    assert ended.value.code == 128 + signal.SIGTERM
    assert started[0].returncode == -signal.SIGKILL


def test_a_program_that_is_missing_is_named():
    with pytest.raises(RobotError, match="no-such-arm cannot be started"):
        make_robot(RobotProgram(command=["no-such-arm"]), print).move("jam")


def test_a_failing_robot_lets_go_once_and_only_after_it_touched_something():
    for step, last in (("loosen", "loosen"), ("jam", "release"), ("release", "release")):
        robot = Logging(fails=step)
        with pytest.raises(RobotError, match=f"{step}: stuck"):
            grasp_once(robot, PLACE, PAPER_SEQUENCE, 0, lambda force: None)
        names = [name for name, _ in robot.steps]
        assert names[-1] == last and names.count("release") == (step != "loosen")


def test_a_robot_lets_go_when_sensing_is_interrupted():
    def interrupt(force):
        raise KeyboardInterrupt

    robot = Logging()
    with pytest.raises(KeyboardInterrupt):
        grasp_once(robot, PLACE, PAPER_SEQUENCE, 0, interrupt)
    assert robot.steps[-1] == ("release", {})
