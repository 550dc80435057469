"""Projects use the workflow as a module: of the package, or of a git repository."""

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
import yaml
from conftest import DECLARATION, ROOT

from ajgdata.paths import PACKAGE

HANDLERS = """

onstart:
    ajg.onstart()


onsuccess:
    ajg.onsuccess()
"""
FROM_GIT = """
module ajg:
    snakefile:
        gitfile("{root}", path="workflow/Snakefile", commit="{commit}")
    config:
        config


use rule * from ajg as ajg_*
"""


def run(project, *arguments):
    """Run Snakemake with the Snakefile and the settings of the project."""
    command = [sys.executable, "-m", "snakemake", "--configfile", "settings.yaml", *arguments]
    command += ["--workflow-profile", str(ROOT / "profiles/default")]
    return subprocess.run(command, cwd=project.root, check=False, capture_output=True, text=True)


def test_the_handlers_of_the_workflow_end_the_run_of_a_project(project):
    """An incomplete run has exit code 1 and its reason, as without a module."""
    (project.root / "Snakefile").write_bytes((PACKAGE / "new_project/Snakefile").read_bytes())
    task = DECLARATION["tasks"]["pitch"] | {"groups": "pitch"}  # each class is one group
    declaration = DECLARATION | {"tasks": {"pitch": task}}
    project.paths.dataset("tones").write_text(yaml.safe_dump(declaration))
    done = run(project)
    assert done.returncode == 1
    assert "machine: " in done.stdout  # the summary, which `onsuccess` prints
    assert "incomplete: tones/pitch skipped" in done.stderr


@pytest.mark.slow
def test_the_workflow_is_deployed_from_a_git_reference(project):
    commit = subprocess.run(
        ["git", "rev-parse", "HEAD"], cwd=ROOT, check=False, capture_output=True, text=True
    ).stdout.strip()
    if not commit:
        pytest.skip("needs the git repository")
    snakefile = FROM_GIT.format(root=ROOT, commit=commit) + HANDLERS
    (project.root / "Snakefile").write_text(snakefile)
    done = run(project)
    assert done.returncode == 0, done.stdout + done.stderr
    assert project.paths.report.is_file()
    assert "machine: " in done.stdout


@pytest.mark.slow
def test_the_small_project_of_the_workflow_runs_and_its_report_is_not_empty(tmp_path):
    """`make test-workflow`: all rules on two simulated cubes, then `snakemake --report`."""
    target = tmp_path / "test"
    shutil.copytree(ROOT / ".test", target, ignore=shutil.ignore_patterns("results", ".snakemake"))
    command = [sys.executable, "-m", "snakemake", "--snakefile", str(ROOT / "workflow/Snakefile")]
    command += ["--configfile", "config/config.yaml"]
    profile = ["--workflow-profile", str(ROOT / "profiles/default")]
    for options in ([*profile, "everything"], ["--report", "report.zip", "--cores", "1"]):
        done = subprocess.run(
            [*command, *options], cwd=target, check=False, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stdout + done.stderr
    with zipfile.ZipFile(target / "report.zip") as report:
        names = {Path(name).name for name in report.namelist()}
    assert {"metrics.csv", "predictions.csv", "spectra--cubes.svg"} < names
    assert (target / "results/published/cubes/croissant.json").is_file()
