"""A folder in which Snakemake can read the state of a project that cannot be written."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

#: Folder in which Snakemake stores its locks and its records of results.
STATE = ".snakemake"
#: Records of results, which a dry run only reads.
RECORDS = ("metadata", "incomplete")


@contextmanager
def writable_view(root: Path) -> Iterator[Path]:
    """Yield the folder `root` if it can be written, else a temporary folder with its content.

    The temporary folder has links to the files and folders of `root`. The state of Snakemake is a
    new folder with links to the records, because Snakemake writes a lock and a cache there even in
    a dry run.
    """
    state = root / STATE
    if os.access(state if state.is_dir() else root, os.W_OK):
        yield root
        return
    with tempfile.TemporaryDirectory() as temporary:
        view = Path(temporary)
        (view / STATE).mkdir()
        for path in root.iterdir():
            if path.name != STATE:
                (view / path.name).symlink_to(path)
        for name in RECORDS:
            if (state / name).is_dir():
                (view / STATE / name).symlink_to(state / name)
        yield view
