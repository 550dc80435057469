"""The whole command: lines in, lines out, as over SSH."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from live_lab import declare
from typer.testing import CliRunner

from ajgdata.cli.main import app
from ajgdata.paths import Paths
from ajgdata.store.sessions import read_recordings, read_session
from ajgdata.types import DataError

HERE = Path(__file__).parent
COMMAND = ["record", "d", "--device", "fake"]


def started(root, faults=()):
    """Start the command with a fake card; `nohup`, under which a test may run, ignores SIGHUP."""
    program = [sys.executable, str(HERE / "live_program.py"), *COMMAND]
    return subprocess.Popen(
        program,
        cwd=root,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=os.environ | {"FAULTS": json.dumps(faults)},
        preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL),  # noqa: PLW1509
    )


@pytest.fixture
def paths(tmp_path):
    layout = Paths(tmp_path)
    declare(layout, samples_per_grasp=1)
    return layout


def qualities(paths):
    return {
        r.recording_id: r.quality for r in read_recordings(paths.session("d", "soundcard-01"))[0]
    }


def test_keep_redo_skip_quit(paths):
    """Enter confirms a grasp; x is no answer; a closed input quits."""
    loud = {"gain": 30.0}
    process = started(paths.root, [loud, {}, loud, loud])
    said, _ = process.communicate("\nx\nr\n\n\nkeep\n\nskip\nq\n", timeout=100)
    assert process.returncode == 3
    expected = (
        "1 of 4: cube",
        "press it on cube with 8 N; then Enter",
        "clipped",
        "k: keep, r: redo, s: skip, q: quit?",
        "q: quit?",
        "1 of 4",
        r"█+·* +-\d+\.\d dBFS",
        "2 of 4: ball",
        "clipped",
        "3 of 4: cube",
        r"dBFS \(usually -",
        "clipped",
        "4 of 4: ball",
        "d/soundcard-01: 4 recorded, 1 grasps left",
        "skipped cube_02",
    )
    assert re.search(".*".join(expected), said, re.DOTALL), said
    assert qualities(paths) == {
        "cube_01_1": "reject",
        "cube_01-2_1": "ok",
        "ball_01_1": "clipped",
        "cube_02_1": "reject",
    }
    assert read_session(paths.session("d", "soundcard-01")).acquisition.finished


ROBOT = """
import json, pathlib, sys, time
step = json.load(sys.stdin)["step"]
with pathlib.Path(sys.argv[1]).open("a") as log:
    print(step, file=log)
time.sleep(float(sys.argv[2]) * (step == "jam"))
"""


def robot(paths, jam_s):
    """Return the command of a robot that logs its steps."""
    program = paths.root / "robot.py"
    program.write_text(ROBOT)
    return [sys.executable, str(program), str(paths.root / "log"), str(jam_s)]


def test_sighup_ends_it_as_ctrl_c_does(paths):
    declare(paths, samples_per_grasp=2, robot={"command": robot(paths, jam_s=60)})
    process = started(paths.root)
    while "jam" not in (log := log_of(paths)):
        assert process.poll() is None
        time.sleep(0.02)
    process.send_signal(signal.SIGHUP)
    said, _ = process.communicate(timeout=60)
    assert (process.returncode, "Traceback" in said) == (128 + signal.SIGHUP, False), said
    assert log_of(paths) == [*log, "release"]  # it does not press on
    assert qualities(paths) == {"cube_01_1": "ok", "cube_01_2": "ok"}
    assert read_session(paths.session("d", "soundcard-01")).acquisition.finished


def test_the_robot_of_a_fetched_data_set_does_not_start(paths, monkeypatch):
    declare(paths, robot={"command": robot(paths, jam_s=0)})
    sums = paths.recordings("d") / "published" / "SHA256SUMS"
    sums.parent.mkdir(parents=True)
    sums.touch()
    monkeypatch.chdir(paths.root)
    with pytest.raises(DataError, match="the robot of a fetched data set does not start"):
        CliRunner().invoke(app, [*COMMAND, "--yes"], catch_exceptions=False)
    assert log_of(paths) == []


def log_of(paths):
    log = paths.root / "log"
    return log.read_text().split() if log.exists() else []
