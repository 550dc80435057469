"""A run that cannot determine what is out of date fails with one line. Snakemake ignores errors of
input functions if the outputs exist, and would report "Nothing to be done"."""

import os
import subprocess
import sys

import pytest
from conftest import Project

from ajgdata.paths import RECORDINGS_FILE

#: Three levels above the labels: Snakemake ignores errors at least one level below its target.
TARGET = "results/metrics.csv"


@pytest.fixture
def relabelled(project) -> Project:
    """A project in which the label of one recording has changed since the run."""
    table = project.folder("day1") / RECORDINGS_FILE
    table.write_text(table.read_text().replace(",low", ",high", 1))
    return project


def failed_run(project: Project, *arguments: str, target: str = TARGET) -> list[str]:
    """Run Snakemake without the capability of root to ignore permissions; return its lines."""
    unprivileged = ["setpriv", "--bounding-set", "-all"] if os.geteuid() == 0 else []
    snakemake = [sys.executable, "-m", "snakemake", *project.arguments(*arguments, target)]
    run = subprocess.run([*unprivileged, *snakemake], check=False, capture_output=True, text=True)
    printed = run.stdout + run.stderr
    assert run.returncode == 1, printed
    assert "Nothing to be done" not in printed
    assert "Traceback" not in printed
    return printed.splitlines()


def test_a_run_fails_if_it_cannot_determine_what_is_out_of_date(relabelled):
    relabelled.folder("day1").chmod(0)
    lines = failed_run(relabelled)
    relabelled.folder("day1").chmod(0o755)
    start = "data/tones/sessions/day1/"
    problem = ": Permission denied. Change its permissions"
    matches = [text for text in lines if text.startswith(start) and problem in text]
    assert len(matches) == 1, lines


def test_a_run_fails_if_it_cannot_write_its_results(relabelled):
    results = relabelled.paths.results
    modes = {path: path.stat().st_mode for path in (results, *results.rglob("*"))}
    for path, mode in modes.items():
        path.chmod(mode & ~0o222)
    failed_run(relabelled)
    for path, mode in modes.items():
        path.chmod(mode)


@pytest.mark.parametrize(
    ("path", "line"),
    [
        (
            "tasks/tones/pitch/cross_validation.gone.json",
            "tones pitch cross_validation gone: not",
        ),
        ("features/gone.nc", "gone: not declared in the data sets of this run"),
    ],
)
def test_a_result_that_is_not_declared_is_never_up_to_date(project, path, line):
    file = project.paths.results / path
    file.parent.mkdir(parents=True, exist_ok=True)
    file.touch()
    lines = failed_run(project, "--dry-run", target=f"results/{path}")
    assert len([text for text in lines if text.startswith(line)]) == 1, lines
