"""Results that are kept by commit, so that a later run can be compared with them.

`.ajgdata/runs/<commit>-<digest>/` holds copies of metrics.csv, metrics.json and predictions.csv.
The digest is of the numbers alone: a run that repeats them takes the place of the one before.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from ajgdata.paths import Paths
from ajgdata.store.files import replacing_folder, write_bytes

#: Runs that are kept, the newest; a whole one takes 7 MB.
KEPT = 10


class KeptRun(NamedTuple):
    """One kept run; the commit ends in `+` if the tree had changes."""

    commit: str
    folder: Path


def keep_run(paths: Paths, commit: str, digest: str, files: Sequence[Path]) -> None:
    """Keep copies of the results `files` of a run, and of older runs the newest alone.

    Nothing is kept without a commit: nobody could ask for it.
    """
    if not commit:
        return
    with replacing_folder(paths.kept_runs / f"{commit}-{digest[:12]}") as new:
        for file in files:
            write_bytes(new / file.name, file.read_bytes())
    for old in kept_runs(paths)[KEPT:]:
        shutil.rmtree(old.folder, ignore_errors=True)


def kept_runs(paths: Paths) -> list[KeptRun]:
    """Return the runs that are kept, the newest first."""
    folders = [f for f in paths.kept_runs.glob("[!.]*-*") if f.is_dir()]
    newest = sorted(folders, key=lambda f: (-f.stat().st_mtime_ns, f.name))
    return [KeptRun(folder.name.rpartition("-")[0], folder) for folder in newest]
