"""Sessions by the command line, through PortAudio: killed, resumed, refused to a second one."""

import os
import random
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import yaml
from test_acquire_killed import left, table, without_a_row
from test_card_through_jack import freewheeling

from ajgdata.cli.console import ATTENTION
from ajgdata.paths import Paths
from ajgdata.pipeline.validate import validate_dataset
from ajgdata.store.sessions import list_sessions, read_session

RESPONSE = 0.02 * np.exp(-np.arange(200) / 40)  # at most 0.8 in all
COMMAND = "from ajgdata.cli import main; main()"
KILLS = int(os.environ.get("AJGDATA_KILLS", "10"))
DECLARATION = {
    "name": "d",
    "excitation": {"kind": "log_sweep", "length_s": 0.2},
    "targets": {"label": {"kind": "classification"}},
    "protocol": {
        "objects": [{"name": n, "targets": {"label": n}} for n in ("cube", "ball")],
        "grasps_per_object": 6,
        "samples_per_grasp": 2,
        "references": {"every": 4},
        "wait_s": 0,
        "robot": {"command": ["true"]},
    },
}
#: Longest time that the robot waits, in s.
PATIENCE_S = 600
#: Program of a robot that waits before grasps 1 and 4 until the file `go-1` or `go-4` exists.
GATED = """
read -r message
case "$message" in *approach*) echo >> calls ;; *) exit 0 ;; esac
number=$(($(wc -l < calls)))
case $number in 1|4) while [ ! -e "go-$number" ]; do sleep 0.1; done ;; esac
"""


@pytest.fixture
def paths(tmp_path):
    folders = Paths(tmp_path / "project")
    folders.dataset("d").parent.mkdir(parents=True)
    declare(folders)
    return folders


def declare(paths, **protocol):
    """Write dataset.yaml, with changes of the protocol."""
    content = DECLARATION | {"protocol": DECLARATION["protocol"] | protocol}
    paths.dataset("d").write_text(yaml.safe_dump(content))


def acquisition(paths, rig, *arguments):
    program = [sys.executable, "-c", COMMAND, "record", "d", "--yes"]
    return subprocess.Popen(
        [*program, "--device", rig.settings.device, *arguments],
        cwd=paths.root,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )


def test_killed_at_random_moments(paths, rig):
    """Each kill takes the process that records; its child, which holds the card, ends with it."""
    started = rig(RESPONSE, noise=1e-4)
    moments = random.Random(0)
    killed = 0
    while killed < KILLS:
        process = acquisition(paths, started)
        process.stdout.readline()  # the first grasp is announced: the card is open
        time.sleep(moments.uniform(0, 4))  # the first take waits 2 s for any latency
        process.kill()
        process.communicate()
        killed += process.returncode == -signal.SIGKILL
    last = list_sessions(paths, "d")[-1:]
    process = acquisition(paths, started, *[word for name in last for word in ("--session", name)])
    output = process.communicate(timeout=900)
    assert process.returncode in (0, ATTENTION), output
    sessions = [read_session(paths.session("d", name)) for name in list_sessions(paths, "d")]
    assert all(session.acquisition.finished for session in sessions)
    # If the computer is too busy to play, such grasps are named and skipped.
    busy = {name: why for session in sessions for name, why in session.skipped.items()}
    assert all(" in doubt: " in reason for reason in busy.values())
    assert [grasp.name for grasp in left(paths) if grasp.name not in busy] == []
    assert without_a_row(paths) == []
    _, issues = validate_dataset(paths, "d")
    assert {issue.code for issue in issues if issue.level != "note"} <= {"skipped"}


def test_a_card_that_went_away_is_named_and_the_session_goes_on_with_another(paths, rig):
    """Each step waits for a state, because a busy machine may miss frames in any take. The robot
    stops before grasps 1 and 4: in between, time runs freely, and no frame is missed."""
    declare(paths, robot={"command": ["sh", "-c", GATED], "timeout_s": PATIENCE_S})
    started = rig(RESPONSE, noise=1e-4)
    process = acquisition(paths, started, "--session", "s1")
    read_until(process, "1 of")  # the card is open
    with freewheeling():
        (paths.root / "go-1").touch()
        read_until(process, "4 of")
    before = {key: row.sha256 for key, row in table(paths).items() if row.quality == "ok"}
    assert len(before) == 6  # three grasps, two recordings of each
    with started.at_next_sound(lambda: os.kill(started.jackd, signal.SIGKILL)):
        (paths.root / "go-4").touch()
        _, errors = process.communicate(timeout=900)
    assert (process.returncode, len(errors.splitlines())) == (1, 1), errors
    assert started.settings.device in errors
    assert read_session(paths.session("d", "s1")).acquisition.finished
    again = acquisition(paths, rig(RESPONSE, noise=1e-4), "--session", "s1")
    assert again.communicate(timeout=900) and again.returncode in (0, ATTENTION)
    assert before.items() <= {key: row.sha256 for key, row in table(paths).items()}.items()


def read_until(process, start):
    """Read what an acquisition prints until a line begins with `start`."""
    lines = []
    for line in process.stdout:
        lines.append(line)
        if line.startswith(start):
            return
    pytest.fail(f"ended without {start!r}: {lines}, {process.communicate()}")
