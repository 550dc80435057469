"""An acquisition that is killed at any moment loses at most the take in the air."""

import hashlib
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from live_lab import declare

from ajgdata.acquire.protocol import plan_protocol, remaining, whole_grasps
from ajgdata.paths import Paths
from ajgdata.pipeline.validate import validate_dataset
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


def table(folder):
    """Rows by recording, each checked against its file; None before the session is there."""
    if not folder.exists():
        return {}
    rows, findings = read_recordings(folder)
    assert findings == []
    for row in rows:
        assert hashlib.sha256((folder / row.file).read_bytes()).hexdigest() == row.sha256
    return {row.recording_id: row for row in rows}


def without_a_row(folder, rows):
    """Recordings that were written and not entered, when an acquisition was killed."""
    known = {Path(row.file).name for row in rows.values()}
    return [p for p in (folder / "audio").glob("*.wav") if p.name[0] != "." and p.name not in known]


@pytest.mark.parametrize("kills", [5, pytest.param(200, marks=pytest.mark.slow)])
def test_killed_at_any_moment(tmp_path, kills):
    paths = Paths(tmp_path)
    declare(paths, grasps_per_object=3, samples_per_grasp=2, references={"every": 4})
    protocol = read_dataset(paths, "d").protocol
    moments = random.Random(kills)
    killed, orphans = 0, set()
    with Victims(paths) as victims:
        while killed < kills:
            sessions = {name: table(paths.session("d", name)) for name in known(paths)}
            ended = victims.run(moments.uniform(0, LONGEST_S))
            killed += ended == signal.SIGKILL
            assert ended in (0, signal.SIGKILL)
            for name in known(paths):
                folder, before = paths.session("d", name), sessions.get(name, {})
                rows = table(folder)
                # What was recorded is there, the same, and at worst rejected for a redone grasp.
                for recording, row in before.items():
                    now = rows[recording]
                    assert now.sha256 == row.sha256
                    assert now.quality in (row.quality, "reject")
                lost = without_a_row(folder, rows)
                assert len(lost) <= 1
                orphans |= set(lost)
            assert killed % 4 or trouble(paths) == []  # half done, and fit to be analysed
        while victims.run() != 0 or left(paths, protocol):
            pass
    assert left(paths, protocol) == []
    for name in known(paths):
        folder = paths.session("d", name)
        rows = table(folder)
        planned = plan_protocol(protocol, name)
        assert without_a_row(folder, rows) == []
        whole = whole_grasps(rows.values())
        assert {n: len(g) for n, g in whole.items()} == {g.name: g.samples for g in planned}
        rejected = [r for r in rows.values() if r.quality == "reject" and not r.labels["reference"]]
        assert all(
            r.grasp_id not in {w.grasp_id for w in whole[r.labels["planned"]]} for r in rejected
        )
    assert trouble(paths) == []
    recorded = sum(len(table(paths.session("d", name))) for name in known(paths))
    print(f"{killed} kills, {recorded} recordings, {len(orphans)} of them without a row at first")


def known(paths):
    return list_sessions(paths, "d")


def left(paths, protocol):
    """Grasps that are still to be made in the sessions that there are."""
    return [
        grasp
        for name in known(paths)
        for grasp in remaining(
            plan_protocol(protocol, name), table(paths.session("d", name)).values()
        )
    ]


def trouble(paths):
    """Errors and warnings of validate."""
    if not known(paths):
        return []
    _, found = validate_dataset(paths, "d", lambda total: lambda: None)
    return [f for f in found if f.level != "note"]
