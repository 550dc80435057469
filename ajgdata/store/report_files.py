"""Files that a person edits to change a report, in `reports/` of the project or of the package.

A file of the project replaces the file of the package with the same name. In a checkout, both
folders are the same.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

from ajgdata.paths import Paths, packaged
from ajgdata.store.files import read_text, read_yaml

PACKAGED = packaged("reports")
#: Published values, with which results are compared.
PAPER_FILE = "paper.yaml"
#: Differences between machines, which `benchmarks/machines.py` measures.
MACHINE_SPREAD_FILE = "machine_spread.yaml"
#: Results that the first page shows under "In practice".
PRACTICE_FILE = "practice.yaml"
TEMPLATES_FOLDER = "templates"
EXPERIMENTS_FOLDER = "experiments"
PAGES_FOLDER = "pages"
#: Files on which pages depend.
_PATTERNS = (
    PAPER_FILE,
    PRACTICE_FILE,
    MACHINE_SPREAD_FILE,
    f"{TEMPLATES_FOLDER}/*.j2",
    f"{TEMPLATES_FOLDER}/*.css",
    f"{TEMPLATES_FOLDER}/*.js",
    f"{EXPERIMENTS_FOLDER}/*.md",
    f"{PAGES_FOLDER}/*.md",
)


def report_file(project: Paths, name: str) -> Path:
    """Return the path of the file `name` (such as `paper.yaml`) of `reports/`.

    It is in the project if the file exists there, else in the package.
    """
    own = project.reports / name
    return own if own.is_file() else PACKAGED / name


def template_folders(project: Paths) -> list[Path]:
    """Return the folders of templates, styles and scripts, in the order in which to search."""
    return [folder / TEMPLATES_FOLDER for folder in (project.reports, PACKAGED)]


def read_paper(project: Paths) -> dict[str, Any]:
    """Return the content of `paper.yaml`. Raises DataError if it is not a YAML mapping."""
    return read_yaml(report_file(project, PAPER_FILE))


def read_machine_spread(project: Paths) -> dict[str, float]:
    """Return the largest difference of our result between machines, in the paper's unit.

    The keys are the published values. The result is empty without a file of measurements.
    """
    path = report_file(project, MACHINE_SPREAD_FILE)
    if not path.is_file():
        return {}
    spread: dict[str, float] = {}
    for row in read_yaml(path)["rows"]:
        spread[row["figure"]] = max(row["spread"], spread.get(row["figure"], 0.0))
    return spread


def read_practice(project: Paths) -> list[dict[str, str]]:
    """Return the results of the first page under "In practice": topic, dataset, task, experiment.

    Empty if the project has no such file.
    """
    path = report_file(project, PRACTICE_FILE)
    return list(read_yaml(path)["topics"]) if path.is_file() else []


def read_experiment_text(project: Paths, experiment: str) -> str:
    """Return the Markdown on an experiment; empty without a text."""
    return _read(project, f"{EXPERIMENTS_FOLDER}/{experiment}.md")


def read_page_text(project: Paths, page: str) -> str:
    """Return the Markdown on a page of the report, its title first; empty without a text."""
    return _read(project, f"{PAGES_FOLDER}/{page}.md")


def _read(project: Paths, name: str) -> str:
    path = report_file(project, name)
    return read_text(path) if path.is_file() else ""


def report_files_digest(project: Paths, *names: str) -> str:
    """Return the digest of the files `names` of `reports/`, by default of all files of pages.

    It is a parameter of the rules that render pages, so that Snakemake detects an edit.
    """
    digest = hashlib.sha256()
    for name in names or _all_names(project):
        digest.update(name.encode() + b"\0" + report_file(project, name).read_bytes())
    return digest.hexdigest()[:16]


def _all_names(project: Paths) -> list[str]:
    """Return the names of all files of pages, sorted."""
    names = {
        path.relative_to(folder).as_posix()
        for folder in (project.reports, PACKAGED)
        for pattern in _PATTERNS
        for path in folder.glob(pattern)
        if not path.name.startswith(".")  # a temporary file of an editor
    }
    return sorted(names)
