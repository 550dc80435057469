"""Data sets that come with the package: those of the paper, and public recordings by others."""

from __future__ import annotations

from ajgdata.paths import DATASET_FILE, SOURCE_FILE, Paths, packaged
from ajgdata.store.files import copy_new

_DATASETS = packaged("datasets")
_VARIANTS = packaged("reports") / "variants"
_RENAME = "rename your file, or use a new project"


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
    variants = {paths.variants / file.name: file for file in sorted(_VARIANTS.glob("*.yaml"))}
    new = copy_new({**variants, **sources}, _RENAME)
    return [file.parent.name for file in new if file in sources]


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
    files = {paths.dataset(name): source.with_name(DATASET_FILE), paths.source(name): source}
    copy_new(files, _RENAME)
    return True


def public_datasets() -> list[str]:
    """Return the names of the public recordings whose settings come with the package."""
    return sorted(file.parent.name for file in _DATASETS.glob(f"*/{SOURCE_FILE}"))
