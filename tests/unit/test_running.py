"""Runs that were killed stand in nobody's way; living ones are left alone."""

import fcntl
import os

from ajgdata.paths import Paths
from ajgdata.pipeline.running import note_run


def told_to_a_run(paths: Paths) -> str:
    """What a run is told that ends at once, as a process of its own."""
    told, tell = os.pipe()
    pid = os.fork()
    if not pid:
        try:
            os.write(tell, note_run(paths).encode() or b"nobody")
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
    paths.cache.mkdir()
    alive = os.open(paths.run_lock, os.O_RDWR | os.O_CREAT)
    fcntl.flock(alive, fcntl.LOCK_SH)
    os.write(alive, b"pid 1 on a since b")
    assert told_to_a_run(paths) == "pid 1 on a since b"
    assert lock.exists()
    assert stale.exists()
    os.close(alive)  # as the system does for a process that is killed
    assert told_to_a_run(paths) == "nobody"
    assert not lock.exists()
    assert not stale.parent.exists()
    lock.write_text("")  # of a run that was killed since
    assert told_to_a_run(paths) == "nobody"
    assert not lock.exists()
