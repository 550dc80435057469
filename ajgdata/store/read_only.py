"""A folder in which Snakemake can read the state of a project without writing into it."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ajgdata.types import DataError

#: Folder in which Snakemake stores its locks and its records of results.
STATE = ".snakemake"
#: Records of results, which a dry run only reads.
RECORDS = ("metadata", "incomplete")


@contextmanager
def writable_view(root: Path) -> Iterator[Path]:
    """Yield a temporary folder with the content of the folder `root`.

    The temporary folder has links to the files and folders of `root`. The state of Snakemake is a
    new folder with links to the records, because Snakemake writes a lock and a cache there even in
    a dry run. If the system does not allow links (Windows, by default), the folder is `root`
    itself. Raises DataError if `root` can then not be written.
    """
    with tempfile.TemporaryDirectory() as temporary:
        view = Path(temporary)
        try:
            _link_project(root, view)
        except OSError as error:
            state = root / STATE
            if not os.access(state if state.is_dir() else root, os.W_OK):
                problem = (
                    f"is read-only, and links to its files are not possible ({error.strerror})"
                )
                raise DataError(root, problem, "make the folder writable") from None
            view = root
        yield view


def _link_project(root: Path, view: Path) -> None:
    """Fill `view` with links to the content of `root`, and with a new folder of Snakemake's state.

    Raises OSError.
    """
    (view / STATE).mkdir()
    for path in root.iterdir():
        if path.name != STATE:
            (view / path.name).symlink_to(path)
    for name in RECORDS:
        records = root / STATE / name
        if records.is_dir():
            (view / STATE / name).symlink_to(records)
