"""Files that a person edits to change a report: `reports/`, the project's own or the packaged one.

A file in the project's `reports/` takes the place of the packaged file of that name; every other
one stays as packaged. In a checkout both are one folder.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

from ajgdata.paths import Paths
from ajgdata.store.files import read_text, read_yaml
from ajgdata.store.provenance import PACKAGE

#: A wheel holds the folder as part of the package (setup.py); in a checkout it is at the top.
_IN_WHEEL = PACKAGE / "reports"
PACKAGED = _IN_WHEEL if _IN_WHEEL.is_dir() else PACKAGE.parent / "reports"
#: Published values, with which results are compared.
PAPER_FILE = "paper.yaml"
#: Differences between machines, which `benchmarks/machines.py` measures.
MACHINE_SPREAD_FILE = "machine_spread.yaml"
#: Results that the first page shows under "In practice".
PRACTICE_FILE = "practice.yaml"
TEMPLATES_FOLDER, EXPERIMENTS_FOLDER, PAGES_FOLDER = "templates", "experiments", "pages"
_PATTERNS = (
    *(f"{TEMPLATES_FOLDER}/*.{suffix}" for suffix in ("j2", "css", "js")),
    *(f"{EXPERIMENTS_FOLDER}/*.md", f"{PAGES_FOLDER}/*.md"),
)


def report_file(project: Paths, name: str) -> Path:
    """Return where the file `name` (such as `paper.yaml`) of `reports/` is: in the project or in
    the package. A name that is in neither gives its place in the package."""
    own = project.reports / name
    return own if own.is_file() else PACKAGED / name


def template_folders(project: Paths) -> list[Path]:
    """Return the folders in which to look for a template, style or script, first match first."""
    return [folder / TEMPLATES_FOLDER for folder in (project.reports, PACKAGED)]


def read_paper(project: Paths) -> dict[str, Any]:
    """Return the content of `paper.yaml`. Raises DataError if it is no YAML mapping."""
    return read_yaml(report_file(project, PAPER_FILE))


def read_machine_spread(project: Paths) -> dict[str, float]:
    """Return the largest measured difference of our value between machines, in the paper's unit, by
    published value; empty if nothing was measured."""
    path, spread = report_file(project, MACHINE_SPREAD_FILE), dict[str, float]()
    for row in read_yaml(path)["rows"] if path.is_file() else ():
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
    """Return the digest of the files `names` of `reports/` (default: all that pages are made of).

    Rules that render pages pass it as a parameter: Snakemake then notices an edit.
    """
    digest = hashlib.sha256()
    for name in names or _all_names(project):
        digest.update(name.encode() + b"\0" + report_file(project, name).read_bytes())
    return digest.hexdigest()[:16]


def _all_names(project: Paths) -> list[str]:
    names = {
        path.relative_to(folder).as_posix()
        for folder in (project.reports, PACKAGED)
        for pattern in (PAPER_FILE, PRACTICE_FILE, MACHINE_SPREAD_FILE, *_PATTERNS)
        for path in folder.glob(pattern)
        if not path.name.startswith(".")  # an editor's
    }
    return sorted(names)
