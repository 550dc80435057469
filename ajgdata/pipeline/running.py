"""Which runs of the workflow and which of their jobs are alive, so that dead ones stand in nobody's
way.

Snakemake's own lock of the project stays when its process is killed. Each run holds another one,
shared, which the system takes back from the dead, and so does each job: jobs outlive a run that is
killed alone. Whoever gets both alone removes what those before left.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.store.locks import described, holder, remove_abandoned

ORPHANS = (
    "jobs of a run that was killed are still at work here: wait until they end, or end them, then "
    "start again"
)


def note_run(paths: Paths, *, local: bool = True) -> str:
    """Note, until this process ends, that it runs the workflow; return what is to be said of others
    that are at work, "" if none are.

    What killed runs left is removed, if nobody is at work: Snakemake's lock and temporary files;
    not for a run that is not `local`, as locks need not be seen by all nodes of a cluster. Where
    there are no locks, or those of another user, nothing is noted and nothing removed.
    """
    try:
        import fcntl

        paths.run_lock.parent.mkdir(parents=True, exist_ok=True)
        held = _opened(paths.run_lock)  # open until the process ends
    except (ImportError, OSError):  # no Unix, or not ours
        return ""
    try:
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        fcntl.flock(held, fcntl.LOCK_SH)
        said = "what both would make, the later one is refused by Snakemake"
        return f"another run is at work here ({holder(paths.run_lock)}): {said}"
    except OSError:
        os.close(held)
        return ""
    said = _cleared(paths) if local else ""
    os.truncate(held, 0)
    os.pwrite(held, described().encode(), 0)
    fcntl.flock(held, fcntl.LOCK_SH)
    return said


def _cleared(paths: Paths) -> str:
    """Remove what killed runs left, unless their jobs are alive, of which the line is returned."""
    import fcntl

    try:
        jobs = _opened(paths.jobs_lock)
    except OSError:
        return ""
    try:
        fcntl.flock(jobs, fcntl.LOCK_EX | fcntl.LOCK_NB)
        for lock in paths.snakemake_locks.glob("*.lock"):
            lock.unlink(missing_ok=True)
        for folder in (paths.results, paths.data, paths.cache):
            remove_abandoned(folder)
    except BlockingIOError:
        return ORPHANS
    except OSError:  # what another user left
        return ""
    finally:
        os.close(jobs)
    return ""


@contextmanager
def noted_job(paths: Paths) -> Iterator[None]:
    """Note that this process does a job of a run, if a run can be noted here."""
    try:
        import fcntl

        held = _opened(paths.jobs_lock)
    except (ImportError, OSError):
        yield
        return
    try:
        with contextlib.suppress(OSError):  # no locks here
            fcntl.flock(held, fcntl.LOCK_SH)
        yield
    finally:
        os.close(held)


def _opened(lock: Path) -> int:
    return os.open(lock, os.O_RDWR | os.O_CREAT, 0o666)
