"""Data sets that come with the package: those of the paper, and public recordings by others."""

from __future__ import annotations

from pathlib import Path

from ajgdata.paths import DATASET_FILE, SOURCE_FILE, Paths, packaged
from ajgdata.store.files import write_bytes
from ajgdata.types import DataError

_DATASETS = packaged("datasets")
_VARIANTS = packaged("reports") / "variants"


def copy_paper_datasets(paths: Paths) -> list[str]:
    """Copy the simulated data sets of the paper, and the files of their variants, into a project.

    Returns the names of the data sets that were not there. Raises DataError, and copies nothing, if
    the project has a file with the same name and other content.
    """
    sources = {
        paths.dataset(file.parent.name): file
        for file in sorted(_DATASETS.glob(f"*/{DATASET_FILE}"))
        if not file.with_name(SOURCE_FILE).exists()
    }
    new = [file.parent.name for file in sources if not file.exists()]
    variants = sorted(_VARIANTS.glob("*.yaml"))
    _copy({**sources, **{paths.variants / file.name: file for file in variants}})
    return new


def copy_public_dataset(paths: Paths, name: str) -> bool:
    """Copy the settings of the public recordings `name` into a project that does not have them.

    Returns whether there are public recordings of this name.
    """
    if paths.source(name).is_file():
        return True
    if name not in public_datasets():
        return False
    # source.yaml is last: with it, the data set can be fetched.
    source = _DATASETS / name / SOURCE_FILE
    _copy({paths.dataset(name): source.with_name(DATASET_FILE), paths.source(name): source})
    return True


def public_datasets() -> list[str]:
    """Return the names of the public recordings whose settings come with the package."""
    return sorted(file.parent.name for file in _DATASETS.glob(f"*/{SOURCE_FILE}"))


def _copy(sources: dict[Path, Path]) -> None:
    """Copy each source to its target; nothing is copied if a target differs (DataError)."""
    for target, source in sources.items():
        if target.exists() and target.read_bytes() != source.read_bytes():
            fix = "rename your data set, or use a new project"
            raise DataError(target, "differs from the file of the package", fix)
    for target, source in sources.items():
        if not target.exists():
            write_bytes(target, source.read_bytes())
