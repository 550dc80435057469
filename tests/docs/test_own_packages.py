"""The example packages, installed with pip: their models and experiment run."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "docs" / "examples"
PROGRAM = """
import json
from experiment_samples import measured, small_inputs, task_results
from ajgdata.experiments.registry import load_experiment, measuring_half
from ajgdata.store.code_hash import code_hash
from ajgdata.models import make_model
from ajgdata.types import DatasetSpec
from ajgdata.types.input_layout import InputLayout
from ajgdata.types.registry import TRUSTED_TYPES
import numpy as np

layout = InputLayout({"time": np.arange(4) / 8, "mel": np.arange(3)})
spec = DatasetSpec.model_validate({
    "name": "d", "title": "d", "description": "d",
    "targets": {"object": {"kind": "classification"}},
    "tasks": {"t": {"target": "object", "models": ["pca_linear"],
              "experiments": {"repeatability": {}}}},
})
inputs = small_inputs()
own = measured("cross_validation", inputs, "pca_linear", models=["pca_linear"])
scores = next(table for table in own.tables if table.name == "scores")
accuracy = scores.where(metric="accuracy", statistic="mean", split="grouped").rows[0]["value"]
outcome = measured("repeatability", inputs)
results = task_results("repeatability", {"": outcome})
experiment = load_experiment("repeatability")
print(json.dumps({
    "accuracy": accuracy,
    "distances": {row["pairs"]: row["distance"] for row in outcome.tables[1].rows},
    "rows": len(list(experiment.rows(results))),
    "figures": len(list(experiment.figures(results))),
    "files": [str(source.file) for source in measuring_half("repeatability")],
    "hashes": [code_hash("features"), code_hash("train")],
    "dimensions": make_model("modulations", "regression", layout=layout).estimator[0].frame_s,
    "types": [name for name in TRUSTED_TYPES if name.startswith("own_")],
}))
"""


def install(package: Path, target: Path) -> None:
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps"]
    command += ["--no-build-isolation", "--disable-pip-version-check", "--target", str(target)]
    subprocess.run([*command, str(package)], check=True)


def run(*paths: Path) -> dict:
    path = os.pathsep.join(map(str, (*paths, ROOT, ROOT / "tests" / "unit")))
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        env=os.environ | {"PYTHONPATH": path},
        check=True,
        capture_output=True,
        text=True,
    )
    return json.loads(done.stdout)


def test_an_own_model_and_an_own_experiment(tmp_path):
    for name in ("own_model", "own_dimensions", "own_experiment"):
        source = tmp_path / name
        source.mkdir()
        for file in (EXAMPLES / f"{name}_package").iterdir():
            if file.is_file():
                (source / file.name).write_bytes(file.read_bytes())
        install(source, tmp_path / "installed")
    result = run(tmp_path / "installed")
    assert result["accuracy"] > 0.5  # chance is 1/3
    distances = result["distances"]
    # recordings of a grasp differ by 1 %, the others by as much as the spectra themselves
    assert distances["same grasp"] < 0.05 * distances["same label, other grasp"]
    assert distances["same label, other grasp"] < distances["other label"]
    assert (result["rows"], result["figures"]) == (3, 1)
    assert result["dimensions"] == 1 / 8  # s, from the coordinates
    assert result["types"] == ["own_dimensions.Modulations"]
    assert str(tmp_path / "installed" / "own_experiment.py") in result["files"]
    # an edit of the model concerns models, not features
    with (tmp_path / "installed" / "own_model.py").open("a") as stream:
        stream.write("\nEDITED = True\n")
    features, models = result["hashes"]
    # an experiment is also measured again after an edit of a module that it measures with
    own = tmp_path / "installed" / "own_experiment.py"
    begin = "    data = inputs.data()"
    assert own.read_text().count(begin) == 1
    added = "    from ajgdata.evaluate.metrics import wrapped  # noqa: F401\n"
    own.write_text(own.read_text().replace(begin, added + begin))
    edited = run(tmp_path / "installed")
    assert edited["hashes"][0] == features and edited["hashes"][1] != models
    added = {Path(file).name for file in set(edited["files"]) - set(result["files"])}
    assert added == {"metrics.py"}


@pytest.mark.parametrize(
    ("noun", "value"), [("model", "clash:make"), ("experiment", "clash:EXPERIMENT")]
)
def test_an_own_entry_with_a_built_in_name_is_an_error(tmp_path, noun, value):
    name = {"model": "knn", "experiment": "shortcut"}[noun]
    (tmp_path / "clash.py").write_text("from ajgdata.experiments.shortcut import EXPERIMENT\n")
    about = tmp_path / "clash-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: clash\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[ajgdata.{noun}s]\n{name} = {value}\n")
    done = subprocess.run(
        [sys.executable, "-c", "import ajgdata.experiments.registry"],
        check=False,
        capture_output=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(map(str, (tmp_path, ROOT)))},
        text=True,
    )
    assert done.returncode == 1
    problem = f"ImportError: package clash: {noun} {name!r} exists, rename it"
    assert done.stderr.splitlines()[-1] == problem
