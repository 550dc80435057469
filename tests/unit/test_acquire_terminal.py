"""The whole command at a pseudo-terminal, as over SSH: lines in, lines out, no display, no keys."""

import json
import os
import pty
import re
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from live_lab import declare
from typer.testing import CliRunner

from ajgdata.acquire.operator import meter
from ajgdata.cli.main import app
from ajgdata.paths import Paths
from ajgdata.store.sessions import read_recordings, read_session
from ajgdata.types import DataError

HERE = Path(__file__).parent
COMMAND = ["acquire", "d", "--device", "fake"]


def _hears_hang_up():
    """Undo what `nohup` does, under which a test may run."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


class Terminal:
    """A program at a pseudo-terminal of its own; without DISPLAY, as a login over SSH has it."""

    def __init__(self, root, *arguments, faults=()):
        self.master, slave = pty.openpty()
        environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "COLUMNS")}
        environment |= {"TERM": "vt100", "FAULTS": json.dumps(faults)}
        program = [sys.executable, str(HERE / "live_program.py"), *COMMAND, *arguments]
        self.process = subprocess.Popen(
            program, cwd=root, stdin=slave, stdout=slave, stderr=slave, env=environment,
            start_new_session=True,
            preexec_fn=_hears_hang_up,  # noqa: PLW1509 - no threads here
        )  # fmt: skip
        os.close(slave)
        self.text = ""

    def expect(self, text, limit_s=60.0):
        """Read until `text` comes; return what came before it."""
        end = time.monotonic() + limit_s
        while text not in self.text:
            assert time.monotonic() < end, f"no {text!r} in {self.text!r}"
            if select.select([self.master], [], [], 0.2)[0]:
                self.text += self._read()
        before, _, self.text = self.text.partition(text)
        return before

    def type(self, text):
        os.write(self.master, f"{text}\n".encode())

    def end(self, limit_s=60.0):
        """Return the exit code and the last words."""
        end = time.monotonic() + limit_s
        while more := self._read(max(0.0, end - time.monotonic())):
            self.text += more
        os.close(self.master)
        return self.process.wait(60), self.text

    def _read(self, limit_s=60.0):
        if not select.select([self.master], [], [], limit_s)[0]:
            self.process.kill()
            raise AssertionError(f"it goes on after {self.text!r}")
        try:
            return re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", os.read(self.master, 65536).decode())
        except OSError:  # the other end is closed
            return ""


@pytest.fixture
def paths(tmp_path):
    made = Paths(tmp_path)
    declare(made, samples_per_grasp=1)
    return made


def qualities(paths):
    return {
        r.recording_id: r.quality for r in read_recordings(paths.session("d", "soundcard-01"))[0]
    }


def test_keep_redo_skip_quit_at_a_terminal(paths):
    loud = {"gain": 30.0}
    terminal = Terminal(paths.root, faults=[loud, {}, loud, loud])
    terminal.expect("1 of 4")
    assert "press it on cube with 8 N" in terminal.expect("then Enter")
    terminal.type("")
    terminal.expect("clipped")
    terminal.expect("k: keep, r: redo, s: skip, q: quit?")
    terminal.type("x")  # is no answer
    terminal.expect("q: quit?")
    terminal.type("r")
    terminal.expect("1 of 4")
    terminal.expect("then Enter")
    terminal.type("")
    level = terminal.expect("2 of 4")
    assert re.search(r"█+·* +-\d+\.\d dBFS", level)
    assert " left" in terminal.expect("ball")
    terminal.expect("then Enter")
    terminal.type("")
    terminal.expect("q: quit?")
    terminal.type("keep")
    terminal.expect("3 of 4")
    terminal.expect("then Enter")
    terminal.type("")
    assert "dBFS (usually -" in terminal.expect("q: quit?")
    terminal.type("skip")
    terminal.expect("then Enter")
    terminal.type("q")
    code, said = terminal.end()
    assert (code, "d/soundcard-01: 4 recorded, 1 grasps left" in said) == (1, True), said
    assert "skipped cube_02" in said
    assert qualities(paths) == {
        "cube_01_1": "reject", "cube_01-2_1": "ok", "ball_01_1": "clipped", "cube_02_1": "reject",
    }  # fmt: skip
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
    terminal = Terminal(paths.root)
    while "jam" not in (log := log_of(paths)):
        assert terminal.process.poll() is None
        time.sleep(0.02)
    os.kill(terminal.process.pid, signal.SIGHUP)
    code, said = terminal.end()
    assert (code, "Traceback" in said) == (128 + signal.SIGHUP, False), said
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


def test_bars_say_levels():
    assert (meter(3.0), meter(-200.0)) == ("█" * 20, "·" * 20)
    assert meter(-30.0) == "█" * 10 + "·" * 10
