"""The files of a new project, which `ajgdata new` writes."""

from __future__ import annotations

from pathlib import Path

from ajgdata.paths import PACKAGE, Paths, packaged
from ajgdata.store.files import copy_new

#: Files of a project that do not exist in a clone.
_CONTENT = PACKAGE / "new_project"


def create_project(folder: Path) -> list[Path]:
    """Create a project in a folder, which may contain other files; return the new files.

    Existing files stay. A second call adds the files that are missing, for example after an
    interruption. Raises DataError, and writes nothing, if there is a Snakefile of another workflow.
    """
    paths = Paths(folder)
    sources = {
        paths.snakefile: _CONTENT / "Snakefile",
        paths.workflow_settings: packaged("config") / "config.yaml",
        paths.profile: packaged("profiles") / "default/config.yaml",
        paths.slurm_profile: packaged("profiles") / "slurm/config.yaml",
        paths.project_readme: _CONTENT / "README.md",
        paths.gitignore: _CONTENT / "gitignore",
        # These files are last: a folder with datasets/ is a project.
        paths.dataset_schema: packaged("datasets") / paths.dataset_schema.name,
        paths.example_dataset: _CONTENT / "example.yaml",
    }
    needed = {
        file: source
        for file, source in sources.items()
        if file == paths.snakefile or not file.exists()
    }
    new = copy_new(needed, "name another folder: `ajgdata new FOLDER`")
    paths.data.mkdir(exist_ok=True)
    return new
