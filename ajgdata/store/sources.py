"""Sources of public recordings (source.yaml), and the download of the recordings.

`git` downloads the folders of a repository as a partial clone. The hash of a commit covers every
byte below it, so a mirror (`url.<base>.insteadOf` of git) need not be trusted.
"""

from __future__ import annotations

from pathlib import Path

from ajgdata.paths import SOURCE_FILE, Paths, public_recordings
from ajgdata.store.files import read_model, write_if_changed
from ajgdata.store.git import run_git
from ajgdata.store.lock import locked
from ajgdata.store.packaged_datasets import public_datasets
from ajgdata.types import DataError, DatasetSource, GitPart

#: Attributes with which git stores files unchanged: without conversion of line ends, and without
#: filters of the user.
_ATTRIBUTES = b"* -text !eol -ident -filter -working-tree-encoding\n"


def list_sources(paths: Paths) -> list[str]:
    """Return the names of the data sets that can be fetched by name."""
    own = {file.parent.name for file in paths.datasets.glob(f"*/{SOURCE_FILE}")}
    return sorted(own | set(public_datasets()))


def read_source(paths: Paths, dataset: str) -> DatasetSource:
    """Return the source of a data set. Raises DataError with file, line, key, value and fix."""
    path = paths.source(dataset)
    if not path.is_file():
        known = ", ".join(list_sources(paths)) or "none"
        raise DataError(path, "there is no such file", f"fetch one of {known}")
    return read_model(path, DatasetSource)


def bring(dataset: str, source: DatasetSource) -> Path:
    """Download the recordings of a source, each part as in its commit; return their folder.

    Git downloads only missing files. The same call therefore resumes after an interruption, and a
    complete part requires no network.
    """
    folder = public_recordings(dataset).absolute()
    objects = folder.with_name(f"{folder.name}.git")
    with locked(objects, "fetching these recordings"):
        _git(objects, "init", "--quiet", "--bare", "--template=", str(objects))
        for lock_of_killed_git in objects.glob("*.lock"):
            lock_of_killed_git.unlink()
        _git(objects, "config", "remote.origin.url", source.origin.repository)
        write_if_changed(objects / "info" / "attributes", _ATTRIBUTES)
        for part in source.origin.parts:
            _check_out(objects, folder, part)
    return folder


def _check_out(objects: Path, folder: Path, part: GitPart) -> None:
    """Write the files of a part; git downloads those that are missing."""
    present = ("rev-list", "--max-count=1", "--missing=print", part.commit)
    if _git(objects, *present, may_fail=True) != part.commit:
        options = ("--quiet", "--no-tags", "--depth=1", "--filter=blob:none")
        _git(objects, "fetch", *options, "origin", part.commit)
    target = folder / part.into
    target.mkdir(parents=True, exist_ok=True)
    tree = f"{part.commit}:{part.folder}"
    index = str(objects / f"{part.into.replace('/', '%') or 'all'}.index")
    work_tree = ("--work-tree", str(target))
    _git(objects, *work_tree, "read-tree", "--reset", "-u", tree, GIT_INDEX_FILE=index)


def _git(objects: Path, *words: str, may_fail: bool = False, **variables: str) -> str:
    """Return the output of git about the repository `objects`, see `run_git`."""
    command = ("--git-dir", str(objects), *words)
    return run_git(objects, *command, folder=objects.parent, may_fail=may_fail, **variables)
