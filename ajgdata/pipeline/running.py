"""Which runs of the workflow are alive, so that a killed one stands in nobody's way.

Snakemake's own lock of the project stays when its process is killed. Each run holds another one,
shared, which the system takes back from the dead: whoever gets it alone knows that no other run is
alive, and removes what those before left.
"""

from __future__ import annotations

import os

from ajgdata.paths import Paths
from ajgdata.store.locks import described, holder, remove_abandoned


def note_run(paths: Paths) -> str:
    """Note, until this process ends, that it runs the workflow; return who else does, "" if none.

    What killed runs left is removed: Snakemake's lock and temporary files. Where the file system
    has no locks nothing is noted and nothing removed.
    """
    try:
        import fcntl
    except ImportError:  # no Unix
        return ""
    paths.run_lock.parent.mkdir(parents=True, exist_ok=True)
    held = os.open(paths.run_lock, os.O_RDWR | os.O_CREAT, 0o666)  # open until the process ends
    try:
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        fcntl.flock(held, fcntl.LOCK_SH)
        return holder(paths.run_lock)
    except OSError:
        os.close(held)
        return ""
    if left := list(paths.snakemake_locks.glob("*.lock")):
        for lock in left:
            lock.unlink(missing_ok=True)
        for folder in (paths.results, paths.data, paths.cache):
            remove_abandoned(folder)
    os.truncate(held, 0)
    os.pwrite(held, described().encode(), 0)
    fcntl.flock(held, fcntl.LOCK_SH)
    return ""
