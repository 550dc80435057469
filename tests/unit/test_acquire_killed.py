"""An acquisition that is killed at any moment loses at most the recording that it was making."""

import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from live_lab import declare

from ajgdata.acquire.protocol import plan_protocol, remaining
from ajgdata.paths import Paths
from ajgdata.pipeline.validate import validate_dataset
from ajgdata.store.audio import file_sha256
from ajgdata.store.sessions import list_sessions, read_dataset, read_recordings

HERE = Path(__file__).parent
#: An acquisition of 20 takes needs some 0.5 s: kills fall anywhere within its first half, and
#: the next one goes on there.
LONGEST_S = 0.25


class Victims:
    """Acquisitions that are killed after a while."""

    def __init__(self, paths):
        program = [sys.executable, HERE / "live_program.py", "forks"]
        self.process = subprocess.Popen(
            program, cwd=paths.root, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.number = 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.communicate(timeout=60)
        assert self.process.returncode == 0

    def run(self, kill_after_s=None) -> int:
        """Return how one acquisition ended: 0, or the signal."""
        self.number += 1
        print(self.number, file=self.process.stdin, flush=True)
        pid = int(self.process.stdout.readline())
        if kill_after_s is not None:
            time.sleep(kill_after_s)
            subprocess.run(["kill", "-9", str(pid)], check=False, stderr=subprocess.DEVNULL)
        return int(self.process.stdout.readline())


def table(paths):
    """Rows of all sessions by session and recording; each has the hash of its file."""
    result = {}
    for name in list_sessions(paths, "d"):
        folder = paths.session("d", name)
        rows, issues = read_recordings(folder)
        assert issues == []
        for row in rows:
            assert file_sha256(folder / row.file) == row.sha256
            result[name, row.recording_id] = row
    return result


def without_a_row(paths):
    """Recordings that a killed acquisition wrote and did not enter."""
    known = {(name, Path(row.file).name) for (name, _), row in table(paths).items()}
    files = paths.sessions("d").glob("*/audio/[!.]*.wav")
    return [path for path in files if (path.parents[1].name, path.name) not in known]


def left(paths):
    """Grasps that are still to be recorded in the sessions that exist."""
    protocol = read_dataset(paths, "d").protocol
    return [
        grasp
        for name in list_sessions(paths, "d")
        for grasp in remaining(
            plan_protocol(protocol, name), read_recordings(paths.session("d", name))[0]
        )
    ]


@pytest.mark.parametrize("kills", [5, pytest.param(200, marks=pytest.mark.slow)])
def test_killed_at_any_moment(tmp_path, kills):
    paths = Paths(tmp_path)
    declare(paths, grasps_per_object=3, samples_per_grasp=2, references={"every": 4})
    moments = random.Random(kills)
    killed = 0
    with Victims(paths) as victims:
        while killed < kills:
            before = table(paths)
            ended = victims.run(moments.uniform(0, LONGEST_S))
            assert ended in (0, signal.SIGKILL)
            killed += ended == signal.SIGKILL
            rows = table(paths)
            # Recordings stay the same; those of a grasp that is recorded again are rejected.
            for key, row in before.items():
                assert rows[key].sha256 == row.sha256
                assert rows[key].quality in (row.quality, "reject")
            assert len(without_a_row(paths)) <= 1
        while victims.run() != 0 or left(paths):
            pass
    assert without_a_row(paths) == []
    _, issues = validate_dataset(paths, "d")
    # All grasps of the lab have the same sound.
    assert [i for i in issues if i.level != "note" and i.code != "similar"] == []
