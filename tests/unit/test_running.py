"""Runs that were killed stand in nobody's way; living ones are left alone."""

import fcntl
import os

from ajgdata.paths import Paths
from ajgdata.pipeline.running import ORPHANS, note_run, noted_job


def told_to_a_run(paths: Paths, *, local: bool = True) -> str:
    """What a run is told that ends at once, as a process of its own."""
    told, tell = os.pipe()
    pid = os.fork()
    if not pid:
        try:
            os.write(tell, note_run(paths, local=local).encode() or b"nobody")
        finally:  # never the tests that come after, in a second process
            os._exit(0)
    os.close(tell)
    os.waitpid(pid, 0)
    with os.fdopen(told) as stream:
        return stream.read()


def test_the_lock_of_a_killed_run_goes_and_that_of_a_living_one_stays(tmp_path):
    paths = Paths(tmp_path)
    lock = paths.snakemake_locks / "0.input.lock"
    stale = paths.results / ".metrics.json.tmp" / "metrics.json"
    for made in (lock, stale):
        made.parent.mkdir(parents=True)
        made.write_text("")
    os.utime(stale.parent, (0, 0))
    paths.cache.mkdir()
    alive = os.open(paths.run_lock, os.O_RDWR | os.O_CREAT)
    fcntl.flock(alive, fcntl.LOCK_SH)
    os.write(alive, b"pid 1 on a since b")
    assert "another run is at work here (pid 1 on a since b): " in told_to_a_run(paths)
    assert lock.exists()
    assert stale.exists()
    os.close(alive)  # as the system does for a process that is killed
    assert told_to_a_run(paths) == "nobody"
    assert not lock.exists()
    assert not stale.parent.exists()
    lock.write_text("")  # of a run that was killed since
    assert told_to_a_run(paths) == "nobody"
    assert not lock.exists()


def left_by_a_killed_run(paths: Paths):
    lock = paths.snakemake_locks / "0.input.lock"
    lock.parent.mkdir(parents=True)
    lock.write_text("")
    return lock


def test_jobs_that_outlive_their_run_are_told_and_keep_its_lock(tmp_path):
    paths = Paths(tmp_path)
    lock = left_by_a_killed_run(paths)
    paths.cache.mkdir()
    with noted_job(paths):
        assert told_to_a_run(paths) == ORPHANS
        assert lock.exists()
    assert told_to_a_run(paths) == "nobody"
    assert not lock.exists()


def test_what_was_half_written_goes_where_snakemake_left_no_lock(tmp_path):
    paths = Paths(tmp_path)
    stale = paths.data / "d" / ".x.tmp"
    stale.mkdir(parents=True)
    os.utime(stale, (0, 0))
    assert told_to_a_run(paths) == "nobody"
    assert not stale.exists()


def test_on_a_cluster_locks_are_removed_by_hand(tmp_path):
    paths = Paths(tmp_path)
    lock = left_by_a_killed_run(paths)
    assert told_to_a_run(paths, local=False) == "nobody"
    assert lock.exists()


def test_the_lock_of_another_user_is_no_error(tmp_path, monkeypatch):
    paths = Paths(tmp_path)
    lock = left_by_a_killed_run(paths)

    def refused(path, *_):
        raise PermissionError(13, "Permission denied", path)

    monkeypatch.setattr(os, "open", refused)
    assert note_run(paths) == ""
    with noted_job(paths):
        assert lock.exists()
