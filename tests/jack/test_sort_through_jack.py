"""Sorting through PortAudio: the sound card goes away in mid-run, and the robot halts."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

import ajgdata
from ajgdata.features.spectrum import frequencies_hz
from ajgdata.live.events import read_events
from ajgdata.paths import Paths
from ajgdata.pipeline.train import train_model
from ajgdata.pipeline.validate import validate_dataset
from ajgdata.store.features import Shard, text_column, write_store
from ajgdata.store.sessions import read_recordings, read_session

RESPONSE = 0.02 * np.exp(-np.arange(200) / 40)
DECLARATION = {
    "name": "d",
    "excitation": {"kind": "log_sweep", "length_s": 0.2},
    "targets": {"label": {"kind": "classification"}},
    "tasks": {"what": {"target": "label", "models": ["linear"]}},
}
ROBOT = 'read asked; echo "$asked" >> robot.log'
PLAN = {
    "dataset": "d", "task": "what", "model": "linear", "threshold": 0.0, "wait_s": 0,
    "bins": {"ball": "A", "cube": "B"}, "unknown": "reject", "reject_bin": "R",
    "robot": "command", "robot_settings": {"command": ["sh", "-c", ROBOT]}, "references": None,
}  # fmt: skip


@pytest.fixture
def paths(tmp_path):
    """A project with a model of two made-up classes: what is heard is like neither of them."""
    made = Paths(tmp_path / "project")
    made.dataset("d").parent.mkdir(parents=True)
    made.dataset("d").write_text(yaml.safe_dump(DECLARATION))
    spec = ajgdata.load_dataset("d", made.root).spec
    frequency_hz = frequencies_hz(44_100, spec.features)
    random, names = np.random.default_rng(0), [f"g{n}" for n in range(20)]
    slope = np.where(np.arange(20) % 2, 1.0, -1.0)[:, np.newaxis] * np.linspace(-1, 1, 1025)
    feature = (2 + slope + 0.1 * random.standard_normal((20, 1025))).astype(np.float32)
    columns = {
        "recording": text_column(names),
        "grasp_id": text_column(names),
        "object": text_column(["x"] * 20),
        "label": text_column(["ball", "cube"] * 10, role="target"),
    }
    settings = {key: getattr(spec, key).model_dump(mode="json") for key in ("audio", "features")}
    shard = Shard(feature, frequency_hz, columns, {"settings": json.dumps(settings)})
    write_store(made.features("d"), shard, {"units": "1"})
    train_model(
        made.features("d"), **spec.training("what"), model="linear", seed=0, task="what",
        folder=made.model("d", "what", "linear"),
    )  # fmt: skip
    return made


def test_a_card_that_goes_away_ends_in_the_robot_s_halt(paths, rig):
    started = rig(RESPONSE, noise=1e-4)
    card = {"device": started.settings.device, "loopback_channel": 2, "attempts": 20}
    (paths.root / "plan.yaml").write_text(yaml.safe_dump(PLAN | {"card": card}))
    process = subprocess.Popen(
        [sys.executable, "-c", "from ajgdata.cli import main; main()", "sort", "plan.yaml"],
        cwd=paths.root, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )  # fmt: skip
    import jack  # not before there is a server

    try:
        assert "virtual gripper (simulated)" in process.stdout.readline()  # the card is open
        clock = jack.Client("ajgdata-test", no_start_server=True)
        clock.set_freewheel(True)  # time runs as fast as all can follow, be it slowly
        placed = 0
        while placed < 2:
            line = process.stdout.readline()
            assert line, process.communicate()
            placed += " → " in line
        clock.close()  # a client that is closed after its server crashes this process
        os.kill(started.jackd, signal.SIGKILL)
        _, err = process.communicate(timeout=900)
    finally:
        process.kill()
    assert process.returncode == 1, err
    assert "Traceback" not in err and err.splitlines()[-1].startswith("error ")
    log = (paths.root / "robot.log").read_text()
    steps = [json.loads(line) for line in log.splitlines()]
    assert steps[-1]["step"] == "halt"
    assert sum(step["step"] == "halt" for step in steps) == 1
    stopped = read_events(paths.events("d", "sort-01"))[-1]
    assert (stopped["event"], stopped["held"]) == ("stopped", steps[-1]["held"])
    assert stopped["sorts"] >= 2 and stopped["reason"] in err.splitlines()[-1]
    folder = paths.session("d", "sort-01")
    assert read_session(folder).acquisition.finished
    rows, findings = read_recordings(folder)
    files = {Path(row.file).name for row in rows}
    assert findings == [] and files == {one.name for one in (folder / "audio").glob("[!.]*")}
    assert {row.quality for row in rows} == {"reject"} and len(rows) >= 2
    _, found = validate_dataset(paths, "d", lambda total: lambda: None)
    # Nobody has labelled anything yet, and that is all.
    assert {one.code for one in found if one.level == "error"} <= {"declaration"}
