"""Every name that `check` accepts runs: of models, experiments, tasks and variants."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from conftest import DECLARATION, ROOT, copy_workflow
from recorded import record_tones

from ajgdata.paths import Paths
from ajgdata.store.files import read_csv
from ajgdata.types.names import LONGEST_NAME

#: Of the longest name that a data set, a task, a model or a file of variants can have.
LONG = "-".join(str(number) for number in range(100, 200))[:LONGEST_NAME]
NAMES = ("my-model", "plain", "all", LONG)


@pytest.fixture
def environment(tmp_path):
    """Variables of a process with an installed package that has models with all NAMES."""
    installed = tmp_path / "installed"
    about = installed / "own_lab-1.0.dist-info"
    about.mkdir(parents=True)
    (installed / "own_lab.py").write_text(
        "from ajgdata.experiments.conformal_intervals import EXPERIMENT as COVERAGE\n"
        "from dataclasses import replace\n"
        "EXPERIMENT = replace(COVERAGE, spec=replace(COVERAGE.spec, name='My-experiment'))\n"
    )
    (installed / "own_models.py").write_text("from ajgdata.models.baselines import linear_plain\n")
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: own_lab\nVersion: 1.0\n")
    models = "".join(f"{name} = own_models:linear_plain\n" for name in NAMES)
    experiments = "any = own_lab:EXPERIMENT\n"
    (about / "entry_points.txt").write_text(
        f"[ajgdata.models]\n{models}[ajgdata.experiments]\n{experiments}"
    )
    path = os.pathsep.join(map(str, (installed, ROOT)))
    return os.environ | {"PYTHONPATH": path, "AJGDATA_ROOT": str(tmp_path / "project")}


def declare(paths: Paths) -> None:
    """Declare a data set and a task with the longest name, and everything that can have a name."""
    variants = {
        "title": "Windows",
        "question": "Does the window matter?",
        "train": LONG,
        "task": LONG,
        "models": ["knn_plain"],
        "variants": {"hop": {"features": {"hop": 512}}, "same": {}},
    }
    task = DECLARATION["tasks"]["pitch"] | {"models": ["knn_plain", *NAMES]}
    number = task | {"target": "number", "models": ["my-model"]}
    number["experiments"] = {"My-experiment": {"models": ["my-model", LONG]}}
    content = DECLARATION | {
        "name": LONG,
        "targets": {"pitch": {"kind": "classification"}, "number": {"kind": "regression"}},
        "tasks": {LONG: task, "number": number},
    }
    paths.dataset(LONG).parent.mkdir(parents=True)
    paths.dataset(LONG).write_text(yaml.safe_dump(content))
    paths.variants.mkdir(parents=True)
    (paths.variants / f"{LONG}.yaml").write_text(yaml.safe_dump(variants))


def ajgdata(environment, *arguments: str) -> subprocess.CompletedProcess:
    command = [sys.executable, "-c", "from ajgdata.cli import main; main()", *arguments]
    root = environment["AJGDATA_ROOT"]
    return subprocess.run(
        command, cwd=root, env=environment, check=False, capture_output=True, text=True
    )


@pytest.mark.parametrize("name", [20 * "x", 22 * "ab-", "my-" + 21 * "no"])
def test_a_name_that_snakemake_refuses_is_refused_by_check(environment, name):
    """Snakemake takes 20 repetitions of a part for an infinite recursion."""
    paths = Paths(Path(environment["AJGDATA_ROOT"]))
    paths.dataset(name).parent.mkdir(parents=True)
    paths.dataset(name).write_text(f"name: {name}\n")
    checked = ajgdata(environment, "check", name)
    assert checked.returncode == 1
    assert checked.stderr.count("\n") == 1
    assert "20 times" in checked.stderr


@pytest.mark.slow
def test_every_name_that_check_accepts_runs(environment):
    paths = Paths(Path(environment["AJGDATA_ROOT"]))
    declare(paths)
    record_tones(paths, ["day1"])
    paths.sessions("tones").parent.rename(paths.sessions(LONG).parent)
    table = paths.recordings_file(LONG, "day1")
    head, *rows = table.read_text().splitlines()
    lines = [f"{head},number", *(f"{row},{number}" for number, row in enumerate(rows))]
    table.write_text("\n".join(lines) + "\n")
    copy_workflow(paths.root)
    checked = ajgdata(environment, "check", LONG)
    assert "error" not in checked.stderr, checked.stderr
    done = ajgdata(environment, "run", LONG)
    assert done.returncode == 0, done.stdout + done.stderr
    run = Paths(paths.root, LONG)
    rows = read_csv(run.metrics_table)[1]
    evaluated = {row["model"] for row in rows if row["task"] == LONG}
    assert {"knn_plain", *NAMES} <= evaluated
    assert {row["model"] for row in rows if row["metric"] == "coverage"} == {"my-model", LONG}
    assert {path.name for path in paths.model(LONG, LONG, "x").parent.iterdir()} >= set(NAMES)
