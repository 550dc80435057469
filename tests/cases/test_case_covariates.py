"""A covariate of a table, from import to prediction. The planted mass is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml
from recorded import run_experiments
from sounds import RATE_HZ, write_wav

from ajgdata.loading import load_predictor
from ajgdata.pipeline.train import train_model
from ajgdata.store.features import read_store
from ajgdata.store.sessions import read_dataset
from ajgdata.store.tables import read_measurements
from ajgdata.types import DataError

EXAMPLE = Path(__file__).resolve().parents[2] / "docs" / "examples" / "covariates.yaml"
NAME = "filled_bottle"
GRASPS = 30
NOISE_G = 0.2


def write_folder(src, missing=()):
    """Write a recording of each grasp, and their table.

    The level of a tone is the filling and the force together; the mass is that of the filling.
    """
    random = np.random.default_rng(0)
    time_s = np.arange(RATE_HZ // 5) / RATE_HZ
    lines = ["wav,grasp,mass_g,force_n"]
    for grasp, mass_g in enumerate(np.linspace(100, 140, GRASPS)):
        force_n = (4, 6, 8)[grasp % 3]
        level = 0.1 + (mass_g - 100 + random.normal(0, NOISE_G)) / 200 + force_n / 20
        sound = level * np.sin(2 * np.pi * 1000 * time_s) + 1e-5 * random.normal(size=len(time_s))
        write_wav(src / f"{grasp}.wav", sound)
        force = "" if grasp in missing else f"{force_n}"
        lines.append(f"{grasp}.wav,{grasp},{mass_g:.4f},{force}")
    (src / "labels.csv").write_text("\n".join(lines) + "\n")


def declare(paths, model):
    declared = yaml.safe_load(EXAMPLE.read_text())
    # Without normalisation, the bin of the tone is linear in mass and force.
    declared |= {"features": {"normalisation": "none", "window": 256, "hop": 256}}
    for task in declared["tasks"].values():
        task["models"] = [model]
    path = paths.dataset(NAME)
    path.parent.mkdir(parents=True)
    path.write_text(yaml.safe_dump(declared))


def measured(paths):
    """Return description and tables of each measurement by task and model."""
    return {
        (request.task, about["model"]): (about, tables)
        for request in run_experiments(paths, NAME)
        for job in request.jobs
        for about, tables in read_measurements(paths.experiment(*job))
    }


def test_the_mass_is_found_with_the_force(src, paths, ajgdata, features, monkeypatch):
    write_folder(src)
    declare(paths, "knn_plain")
    assert ajgdata("import", src, "--dataset", NAME).code == 0
    features(NAME)
    rmse = {}
    for key, (_, tables) in measured(paths).items():
        (scores,) = [table for table in tables if table.name == "scores"]
        (row,) = scores.where(metric="rmse", split="grouped", statistic="mean").rows
        rmse[key] = row["value"]
    assert set(rmse) == {
        ("mass", "knn_plain"),
        ("mass", "covariates_alone"),
        ("mass_without_force", "knn_plain"),
    }
    assert rmse["mass", "knn_plain"] < 3  # the nearest five of 24 are within 3 g
    # The force shifts the level by 10 g N^-1, so recordings with 4 N and 8 N differ by 40 g.
    assert rmse["mass_without_force", "knn_plain"] > 8
    # It says nothing of the mass alone, which has a standard deviation of 40 / sqrt(12) g.
    assert rmse["mass", "covariates_alone"] == pytest.approx(40 / np.sqrt(12), rel=0.3)

    settings = read_dataset(paths, NAME).training("mass")
    folder = paths.model(NAME, "mass", "knn_plain")
    train_model(
        read_store(paths.features(NAME)), settings, model="knn_plain", seed=0, folder=folder
    )
    predictor = load_predictor(NAME, "mass", "knn_plain", paths.root)
    time_s = np.arange(RATE_HZ // 5) / RATE_HZ
    write_wav(src / "new.wav", (0.1 + 20 / 200 + 6 / 20) * np.sin(2 * np.pi * 1000 * time_s))
    prediction = predictor.predict_file(src / "new.wav", covariates={"force_n": 6})
    assert prediction.value == pytest.approx(120, abs=3)
    assert prediction.interval[0] < 120 < prediction.interval[1]
    with pytest.raises(DataError, match="needs a value of the covariate 'force_n'"):
        predictor.predict_file(src / "new.wav")
    monkeypatch.chdir(paths.root)
    for option, problem in (
        ("force_n", "--covariate: 'force_n' is not NAME=VALUE with a number"),
        ("mass_g=1", "has no covariate 'mass_g'. Remove it: it has force_n"),
    ):
        printed = ajgdata(
            "sense", NAME, "mass", "knn_plain", "--covariate", option, "--device", "x"
        )
        assert printed.code == 1 and problem in printed.text


def test_a_task_with_a_missing_covariate_is_skipped_with_the_recordings(
    src, paths, ajgdata, features
):
    write_folder(src, missing=(3, 11))
    declare(paths, "knn_plain")
    ajgdata("import", src, "--dataset", NAME)
    features(NAME)
    about, _ = measured(paths)["mass", "knn_plain"]
    assert "covariate 'force_n' has no value for 2 of 30 recordings (" in about["skipped"]
    assert about["skipped"].endswith("add the values to recordings.csv, or reject the recordings")
