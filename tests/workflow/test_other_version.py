"""A deleted result is computed again, and the command for a result of another version works."""

import json
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import Project

from ajgdata.cli.project import with_datasets
from ajgdata.experiments.requests import Request, requests_for
from ajgdata.paths import Paths, command_for
from ajgdata.pipeline.task_results import measurements
from ajgdata.store.sessions import read_dataset

NAME = "tones"
ALONE = with_datasets([NAME], [])
CROSS_VALIDATION = (NAME, "pitch", "cross_validation", "plain")


@pytest.fixture(scope="module")
def whole(finished, tmp_path_factory) -> Project:
    """The project after `snakemake` and `ajgdata run tones`."""
    project = finished.copied(tmp_path_factory.mktemp("whole") / "tones")
    project.snakemake()
    project.snakemake(*ALONE)
    assert project.planned() == {}
    assert project.planned(*ALONE) == {}
    return project


@pytest.fixture
def project(whole, tmp_path) -> Project:
    return whole.copied(tmp_path / "copy")


def requests_of(project: Project) -> list[Request]:
    """Return the experiments of the project."""
    spec = read_dataset(project.paths, NAME)
    return requests_for({NAME: spec}, [(NAME, "pitch")])


def results(paths: Paths) -> dict[str, tuple[object, list[str]]]:
    """Return results, by name, with the rules that a run repeats if the result is deleted."""
    follows = ["experiment", "train", "collect", "report"]
    return {
        "features": (paths.features(NAME), ["features", *follows]),
        "quarantine": (paths.quarantine(NAME), ["features", *follows]),
        "experiment": (paths.experiment(*CROSS_VALIDATION), ["experiment", "collect", "report"]),
        "model": (paths.model(NAME, "pitch", "knn"), ["train"]),
        "metrics": (paths.metrics_table, ["collect"]),
        "predictions": (paths.predictions, ["collect"]),
        "report": (paths.report, ["report"]),
        "figures": (paths.report.parent / "figures", ["report"]),
    }


@pytest.mark.parametrize("name", results(Paths()))
def test_a_deleted_result_is_computed_again(project, name):
    result, rules = results(project.paths)[name]
    if result.is_dir():
        shutil.rmtree(result)
    else:
        result.unlink()
    assert {*project.planned()} == {*rules, "complete", "all"}


@pytest.mark.parametrize(
    ("result", "rule"),
    [
        (Paths().features(NAME), "features"),
        (Paths().quarantine(NAME), "features"),
        (Paths().experiment(*CROSS_VALIDATION), "experiment"),
        (Paths(run=NAME).metrics_table, "collect"),
    ],
)
def test_the_command_for_a_result_runs_its_job(project, result, rule):
    """Also if the job is up to date."""
    *command, option, target = shlex.split(command_for(result))
    assert command == ["ajgdata", "run", NAME]
    jobs = project.planned(*with_datasets([NAME], [option, target]))
    assert jobs[rule] == 1
    assert jobs["all"] == 1


def test_the_command_for_a_model_runs_its_job(project):
    """Also if the job is up to date."""
    folder = Paths().model(NAME, "pitch", "knn")
    *command, force = shlex.split(command_for(folder / "model.json"))
    assert command == ["ajgdata", "train", NAME, "pitch", "--model", "knn"]
    assert project.planned(*with_datasets([NAME], [str(folder)])) == {}
    assert project.planned(*with_datasets([NAME], [str(folder), force])) == {"train": 1}


@pytest.mark.parametrize(
    ("result", "command"),
    [
        (Paths().metrics_table, "snakemake --forcerun collect"),
        (Paths().study("stability"), "snakemake --force results/gripper/stability.json"),
        (Paths().latents("ycb", "grasps"), "ajgdata run ycb --forcerun embed"),
        (Paths().latents("results", "results"), "ajgdata run results --forcerun embed"),
        (
            Paths().experiment("results", "tasks", "e", "m"),
            "ajgdata run results --forcerun results/tasks/results/tasks/e.m.json",
        ),
        (Paths(run="a+b").metrics_table, "ajgdata run a b --forcerun collect"),
        (Paths().predictions, "snakemake --forcerun collect"),
        (Path("copied/metrics.csv"), ""),
    ],
)
def test_each_result_has_a_command(tmp_path, result, command):
    """Also if the folder of the project, or a data set, has the name of the results folder."""
    assert command_for(tmp_path / "results" / "project" / result) == command


def test_a_damaged_result_is_listed_by_its_file(project):
    """Also if the line on it has the place of the damage."""
    file = project.paths.experiment(*CROSS_VALIDATION)
    file.write_bytes(file.read_bytes()[:1000])
    request = next(iter(requests_of(project)))
    _, errors = measurements(project.paths, [request])
    assert [*errors] == [file]
    assert errors[file].where.startswith(f"{file}:")


def test_a_result_of_another_version_changes_the_exit_code_until_its_command_has_run(project):
    file = project.paths.experiment(*CROSS_VALIDATION)
    before = file.read_bytes()
    file.write_text(json.dumps(json.loads(before) | {"format": 99}))
    command = [sys.executable, "-m", "snakemake", *project.arguments()]
    run = subprocess.run(command, check=False, capture_output=True, text=True)
    lines = (run.stdout + run.stderr).splitlines()
    assert run.returncode == 1
    assert "incomplete: 1 result could not be read (reasons above)" in lines
    (line,) = (line for line in lines if line.startswith("left out  results/tasks/"))
    advice = line.split("`")[1]
    assert advice == command_for(file)
    project.snakemake(*shlex.split(advice)[-2:])
    assert file.read_bytes() == before
