"""A bug in one model fails its job, with the traceback in its log; all else is made and told."""

import os
import re
import shutil
import subprocess
import sys

import yaml
from conftest import DECLARATION, python_path_with

MODULE = """
from sklearn.dummy import DummyClassifier

from ajgdata.types.registry import Model

BROKEN = Model("somebody:broken", "broken", "broken")


class Broken(DummyClassifier):
    def fit(self, X, y, sample_weight=None):
        raise ValueError("a bug <in> a model")


def broken(kind, seed):
    return Broken()
"""


def test_a_bug_fails_its_job_and_the_rest_goes_on(project, tmp_path):
    path = python_path_with(
        tmp_path / "site", MODULE, "[ajgdata.models]\nbroken = somebody:BROKEN\n"
    )
    task = DECLARATION["tasks"]["pitch"] | {"models": ["broken", "knn"]}
    declared = DECLARATION | {"tasks": {"pitch": task}}
    project.paths.dataset("tones").write_text(yaml.safe_dump(declared))
    for made in (project.paths.report.parent, project.paths.results / "tasks"):
        shutil.rmtree(made)
    command = [sys.executable, "-m", "snakemake", *project.arguments("results/report/index.html")]
    done = subprocess.run(
        [*command, "--keep-going"], check=False, capture_output=True, text=True,
        env={**os.environ, "PYTHONPATH": path},
    )  # fmt: skip
    assert done.returncode == 1
    (file,) = set(re.findall(r"^ *log: (\S+/logs/experiment/\S+)", done.stderr, re.MULTILINE))
    log = (project.root / file).read_text()
    assert "Traceback" in log and "ValueError: a bug <in> a model" in log
    tasks = project.paths.results / "tasks" / "tones" / "pitch"
    names = {one.name for one in tasks.iterdir() if one.name[0] != "."}
    assert names == {"cross_validation-knn.json", "cross_validation-knn.cost.json"}
    assert not project.paths.report.exists()
