"""A position is predicted as a vector: two tones whose amplitudes are linear in x and y."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
import yaml
from recorded import run_experiments
from sounds import RATE_HZ, write_wav

from ajgdata.experiments.requests import SettingsError, requests_for
from ajgdata.store.tables import read_measurements
from ajgdata.types import DatasetSpec

EXAMPLE = Path(__file__).resolve().parents[2] / "docs" / "examples" / "position.yaml"
POINTS = 24


def write_folder(src):
    """Write two recordings of each point, and their table."""
    random = np.random.default_rng(0)
    time_s = np.arange(RATE_HZ // 5) / RATE_HZ
    lines = ["file_name,point,x_m,y_m"]
    for point, (x_m, y_m) in enumerate(random.uniform(-0.1, 0.1, (POINTS, 2))):
        for number in (1, 2):
            name = f"{point}_{number}.wav"
            sound = (0.2 + x_m) * np.sin(2 * np.pi * 1000 * time_s)
            sound += (0.2 + y_m) * np.sin(2 * np.pi * 5000 * time_s)
            write_wav(src / name, sound + 1e-4 * random.normal(size=len(time_s)))
            lines.append(f"{name},{point},{x_m:.6f},{y_m:.6f}")
    (src / "labels.csv").write_text("\n".join(lines) + "\n")


def test_the_position_is_found(src, paths, ajgdata, rows, features):
    write_folder(src)
    declared = yaml.safe_load(EXAMPLE.read_text())
    # Without normalisation, the bins of the tones are linear in x and y.
    declared |= {"features": {"normalisation": "none"}}
    path = paths.dataset("position")
    path.parent.mkdir(parents=True)
    path.write_text(yaml.safe_dump(declared))
    printed = ajgdata("import", src, "--dataset", "position")
    assert printed.code == 0, printed.text
    assert {"x_m", "y_m"} <= set(rows("position")[0])
    assert ajgdata("check", "position").code == 0
    features("position")
    scores = defaultdict(dict)
    for request in run_experiments(paths, "position"):
        for job in request.jobs:
            for about, tables in read_measurements(paths.experiment(*job)):
                (table,) = [table for table in tables if table.name == "scores"]
                rmse = table.where(metric="rmse", split="grouped", condition="")
                key = request.task, about["model"]
                scores[key] = {row["statistic"]: row["value"] for row in rmse.rows}
    vector = scores["position", "linear"]
    # A guess is the mean: its distance is the root of two variances of 0.2² / 12.
    assert vector["chance"] == pytest.approx(np.sqrt(2 * 0.2**2 / 12), rel=0.2)
    assert vector["mean"] < 0.02 * vector["chance"]
    assert vector["grasp low"] < vector["mean"] < vector["grasp high"]
    assert scores["x_m", "linear"]["mean"] < vector["mean"]
    assert scores["position", "knn"]["mean"] < 0.5 * vector["chance"]


def test_other_experiments_refuse_a_vector():
    declared = yaml.safe_load(EXAMPLE.read_text())
    declared["tasks"]["position"]["experiments"] = {"conformal_intervals": {}}
    specs = {"position": DatasetSpec.model_validate(declared)}
    message = "experiments.conformal_intervals is not for a target with columns"
    with pytest.raises(SettingsError, match=message):
        requests_for(specs, [("position", "position")])
