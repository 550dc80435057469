"""The files of a new project, which `ajgdata new` writes."""

from __future__ import annotations

from pathlib import Path

from ajgdata.paths import PACKAGE, Paths, packaged
from ajgdata.store.files import write_bytes
from ajgdata.types import DataError

#: Files of a project, and the files of the package with their content.
_CONTENT = PACKAGE / "new_project"


def create_project(folder: Path) -> list[Path]:
    """Create a project in a folder, which may contain other files; return the new files.

    Raises DataError, and writes nothing, if the folder is a project or if a file exists already.
    """
    paths = Paths(folder)
    if paths.datasets.exists():
        raise DataError(folder, "is already a project", "go there and import recordings")
    sources = {
        paths.snakefile: _CONTENT / "Snakefile",
        paths.profile: packaged("profiles") / "default/config.yaml",
        paths.project_readme: _CONTENT / "README.md",
        paths.gitignore: _CONTENT / "gitignore",
        paths.dataset_schema: packaged("datasets") / paths.dataset_schema.name,
        paths.example_dataset: _CONTENT / "example.yaml",
    }
    existing = [file for file in sources if file.exists()]
    if existing:
        raise DataError(existing[0], "already exists", "name a new folder: `ajgdata new FOLDER`")
    paths.data.mkdir(parents=True, exist_ok=True)
    for file, source in sources.items():  # the files in datasets/ are last: they make it a project
        write_bytes(file, source.read_bytes())
    return list(sources)
