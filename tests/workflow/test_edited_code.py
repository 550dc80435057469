"""An edit of the code computes again what it decides, and nothing else except the report."""

import os
import re
import shutil
import subprocess
import sys

import pytest
from conftest import ROOT, Project, copy_workflow

REPORT = {"report": 1}
MEASURED = {"experiment": 1, "collect": 1, **REPORT}
AFTER_FEATURES = {"features": 1, **MEASURED}


@pytest.fixture
def clone(finished, tmp_path):
    """The finished project, and a clone of the source that a test may edit."""
    folder = copy_workflow(tmp_path / "clone")
    for name in ("ajgdata", "reports"):
        shutil.copytree(ROOT / name, folder / name)
    return Project(finished.root, folder)


def planned(project: Project, *targets: str) -> dict[str, int]:
    """Count the jobs of a dry run with the code of the clone, by rule."""
    command = [sys.executable, "-m", "snakemake", *project.arguments("--dry-run", *targets)]
    environment = os.environ | {"PYTHONPATH": str(project.workflow)}
    done = subprocess.run(
        command, env=environment, cwd=project.root, check=False, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    counts = re.findall(r"^(\w+) +(\d+)$", done.stdout, re.MULTILINE)
    return {rule: int(count) for rule, count in counts if rule != "total"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "old", "new", "jobs"),
    [
        ("store/scan.py", '"""', '"""Edited. ', REPORT),
        ("features/spectrum.py", "_BLOCK = 65_536", "_BLOCK = 65_536  # edited", REPORT),
        ("types/protocol.py", 'description="', 'description="edited: ', REPORT),
        (
            "store/audio.py",
            '"the file is empty", _RECORD_AGAIN',
            '"is empty", _RECORD_AGAIN',
            REPORT,
        ),
        ("experiments/learning_curve.py", "more and more training", "ever more training", REPORT),
        ("features/spectrum.py", '"hann": (0.5, 0.5)', '"hann": (0.6, 0.4)', AFTER_FEATURES),
        (
            "experiments/cross_validation.py",
            'score_table(scores, "Errors")',
            'score_table(scores, "All errors")',
            MEASURED,
        ),
        ("experiments/learning_curve.py", 'title = "Learning curve"', 'title = "Curve"', REPORT),
        ("models/baselines.py", "NEIGHBOURS = ", "NEIGHBOURS = 1 + ", MEASURED),
    ],
    ids=[
        "docstring",
        "comment",
        "help text",
        "message",
        "caption",
        "constant",
        "measure",
        "measure of another experiment",
        "model",
    ],
)
def test_an_edit_computes_again_what_it_decides(clone, file, old, new, jobs):
    path = clone.workflow / "ajgdata" / file
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    assert planned(clone, "results/report/index.html", "results/metrics.csv") == jobs
