"""A package of somebody else adds a model and an experiment; the report has them."""

import csv
import os
import subprocess
import sys

import pytest
import yaml
from conftest import DECLARATION, python_path_with

MODULE = '''
import numpy as np
from sklearn.dummy import DummyClassifier

from ajgdata.experiments.base import Experiment, Outcome, score_table
from ajgdata.report.report_data import ResultRow
from ajgdata.types import Strict
from ajgdata.types.registry import Model

GUESS = Model("somebody:guess", "always the commonest", "always the mean")


def guess(kind, seed):
    return DummyClassifier()


class Settings(Strict):
    """Count the recordings of each class."""

    least: int = 1


def measure(inputs, settings, _):
    names, counts = np.unique(inputs.data().value, return_counts=True)
    rows = [("", f"class:{n}", "recordings", "count", c) for n, c in zip(names, counts)]
    return Outcome((score_table(rows, "Counts"),))


def rows(results):
    for row in results.results[0].tables["scores"].rows:
        yield ResultRow(row["part"], "recordings", f"{row['value']:.0f} counted")


COUNT = Experiment(
    name="count", title="Counts", settings=Settings, measure=measure,
    figures=lambda results: [], rows=rows,
)
'''
POINTS = """
[ajgdata.models]
guess = somebody:GUESS
[ajgdata.experiments]
count = somebody:COUNT
"""


@pytest.mark.slow
def test_what_another_package_registers_has_rows_in_the_report(project, tmp_path):
    path = python_path_with(tmp_path / "site", MODULE, POINTS)
    task = DECLARATION["tasks"]["pitch"] | {"models": ["guess"], "experiments": {"count": {}}}
    project.paths.dataset("tones").write_text(
        yaml.safe_dump(DECLARATION | {"tasks": {"pitch": task}})
    )
    command = [sys.executable, "-m", "snakemake", *project.arguments()]

    def run(*arguments: str) -> str:
        done = subprocess.run(
            [*command, *arguments], check=False, capture_output=True, text=True,
            env={**os.environ, "PYTHONPATH": path},
        )  # fmt: skip
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout + done.stderr

    wanted = ("results/report/index.html", "results/metrics.csv")
    run(*wanted)
    pages = project.paths.report.parent.rglob("*.html")
    text = "".join(page.read_text() for page in pages)
    assert "always the commonest" in text
    assert "8 counted" in text and "class:high" in text
    with project.paths.metrics_table.open(newline="") as stream:
        counted = {
            r["part"]: r["value"] for r in csv.DictReader(stream) if r["statistic"] == "count"
        }
    assert counted == {"class:high": "8", "class:low": "8"}
    (tmp_path / "site" / "somebody.py").write_text(
        MODULE.replace('"recordings", "count"', '"rows", "count"')
    )
    assert "\nexperiment " in run(*wanted, "--dry-run")  # its code changed
