"""Sessions by the command line, through PortAudio: killed, resumed, refused to a second one."""

import hashlib
import os
import random
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import yaml

from ajgdata.acquire.protocol import plan_protocol, remaining, whole_grasps
from ajgdata.paths import Paths
from ajgdata.pipeline.validate import validate_dataset
from ajgdata.store.sessions import list_sessions, read_dataset, read_recordings, read_session

RESPONSE = 0.02 * np.exp(-np.arange(200) / 40)  # at most 0.8 in all
COMMAND = "from ajgdata.cli import main; main()"
KILLS = int(os.environ.get("AJGDATA_KILLS", "10"))
DECLARATION = {
    "name": "d",
    "excitation": {"kind": "log_sweep", "length_s": 0.2},
    "targets": {"label": {"kind": "classification"}},
    "protocol": {
        "objects": [{"name": n, "targets": {"label": n}} for n in ("cube", "ball")],
        "grasps_per_object": 12,
        "samples_per_grasp": 2,
        "references": {"every": 6},
        "wait_s": 0,
    },
}


@pytest.fixture
def paths(tmp_path):
    made = Paths(tmp_path / "project")
    made.dataset("d").parent.mkdir(parents=True)
    made.dataset("d").write_text(yaml.safe_dump(DECLARATION))
    return made


def acquisition(paths, rig, *arguments):
    program = [sys.executable, "-c", COMMAND, "acquire", "d", "--source", "soundcard", "--yes"]
    return subprocess.Popen(
        [*program, "--device", rig.settings.device, *arguments], cwd=paths.root, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip


def rows(paths, name):
    folder = paths.session("d", name)
    held, findings = read_recordings(folder)
    assert findings == []
    for row in held:
        assert hashlib.sha256((folder / row.file).read_bytes()).hexdigest() == row.sha256
    return held


def test_killed_at_random_moments(paths, rig):
    """Each kill takes the process that records; its child, which holds the card, ends with it."""
    started, moments, killed = rig(RESPONSE, noise=1e-4), random.Random(0), 0
    protocol = read_dataset(paths, "d").protocol
    while killed < KILLS:
        process = acquisition(paths, started)
        process.stdout.readline()  # the first grasp is announced: the card is open
        time.sleep(moments.uniform(0, 4))  # the first take waits 2 s for any latency
        process.kill()
        process.communicate()
        killed += process.returncode == -signal.SIGKILL
    process = acquisition(paths, started, *goes_on(paths))
    said = process.communicate(timeout=900)
    assert process.returncode in (0, 1), said
    for name in list_sessions(paths, "d"):
        held, planned = rows(paths, name), plan_protocol(protocol, name)
        # A computer that is too busy to play is no loss: such grasps are named, and left out.
        busy = read_session(paths.session("d", name)).skipped
        assert all(" in doubt: " in reason for reason in busy.values())
        assert remaining(planned, held, busy) == []
        whole = {n: len(g) for n, g in whole_grasps(held).items() if n not in busy}
        assert whole == {g.name: g.samples for g in planned if g.name not in busy}
        assert read_session(paths.session("d", name)).acquisition.finished
        files = {path.name for path in (paths.session("d", name) / "audio").glob("[!.]*.wav")}
        assert files == {row.file.removeprefix("audio/") for row in held}
        rejected = sum(row.quality == "reject" and not row.labels["reference"] for row in held)
        print(f"{name}: {killed} kills, {len(held)} recordings, {rejected} rejected, {busy}")
    _, found = validate_dataset(paths, "d", lambda total: lambda: None)
    assert {one.code for one in found if one.level != "note"} <= {"skipped"}


def goes_on(paths):
    """The session that is not complete, or the first."""
    names = list_sessions(paths, "d")
    return ["--session", names[-1]] if names else []


def test_a_card_that_went_away_is_named_and_the_session_goes_on_with_another(paths, rig):
    started = rig(RESPONSE, noise=1e-4)
    process = acquisition(paths, started, "--session", "s1")
    while not process.stdout.readline().startswith("6 of"):
        pass
    os.kill(started.jackd, signal.SIGKILL)
    _, said = process.communicate(timeout=900)
    assert process.returncode == 1 and len(said.splitlines()) == 1
    assert read_session(paths.session("d", "s1")).acquisition.finished
    before = {row.recording_id: row.sha256 for row in rows(paths, "s1") if row.quality == "ok"}
    assert before
    again = acquisition(paths, rig(RESPONSE, noise=1e-4), "--session", "s1")
    assert again.communicate(timeout=900) and again.returncode in (0, 1)
    after = {row.recording_id: row.sha256 for row in rows(paths, "s1")}
    assert before.items() <= after.items()
