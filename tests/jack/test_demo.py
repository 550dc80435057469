"""`make demo-live`: from a device to a session that validates, by nothing but commands."""

import re
import subprocess
import sys
from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.store.sessions import read_recordings, read_session

PROGRAM = Path(__file__).resolve().parents[2] / "tools/demo_live.py"


def test_demo(tmp_path):
    done = subprocess.run(
        [sys.executable, PROGRAM, tmp_path], check=False, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    print(done.stdout.splitlines()[-1])
    folder = Paths(tmp_path).session("live_session", "soundcard-01")
    rows, _ = read_recordings(folder)
    # Of each of four objects two grasps of two samples, and two of each kind of reference.
    assert len(rows) == 20 and len({row.grasp_id for row in rows if row.object}) == 8
    played = [row.labels for row in rows if row.labels["reference"] != "silence"]
    latencies = {labels["latency_samples"] for labels in played}
    assert latencies == {"1088"}
    assert "virtual gripper" in read_session(folder).device
    assert re.search(r"20 recordings checked: 0 errors, 0 warnings", done.stdout)
