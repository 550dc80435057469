"""`make sort-live` on a small project: two runs through the card, beside the same without it."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

from ajgdata.evaluate.sorting import orders
from ajgdata.experiments import asked_of
from ajgdata.features.spectrum import spectrum
from ajgdata.paths import Paths
from ajgdata.pipeline.experiments import run_experiment
from ajgdata.pipeline.rendering import new_grasps_of
from ajgdata.pipeline.train import train_model
from ajgdata.store.features import Shard, text_column, write_store
from ajgdata.store.files import json_bytes
from ajgdata.store.sessions import read_dataset
from ajgdata.store.tables import read_tables

PROGRAM = Path(__file__).resolve().parents[2] / "tools/sort_live.py"
OBJECTS, PLACEMENTS, RUNS = ("cube_12", "cube_28"), 3, 2
DECLARATION = {
    "name": "d",
    "targets": {"object": {"kind": "classification"}},
    "tasks": {
        "sorting": {
            "target": "object",
            "models": ["linear"],
            "experiments": {
                "live_sorting": {
                    "placements": PLACEMENTS, "looks": 1, "runs": RUNS, "grasps": [],
                    "models": ["linear"],
                }
            },
        }
    },
    "recipe": {
        "grasps_per_object": 1,
        "signal": {"noise_db_spl": None},
        "scene": {"numerics": {"dx_mm": 6, "max_time_s": 0.006}},
        "vary": {"angle_deg": [-10, 10]},
        "objects": [
            {"name": n, "shape": {"kind": "cube", "edge_mm": int(n[-2:])}} for n in OBJECTS
        ],
    },
}  # fmt: skip


@pytest.fixture
def project(tmp_path) -> Paths:
    """Eight grasps in the feature store, the model that they train, and the experiment."""
    paths = Paths(tmp_path / "project")
    paths.dataset("d").parent.mkdir(parents=True)
    paths.dataset("d").write_text(yaml.safe_dump(DECLARATION))
    spec, sensed = read_dataset(paths, "d"), new_grasps_of(paths, "d")
    wanted = [(name, number, 1) for name in OBJECTS for number in range(101, 105)]
    rate, settings = spec.audio.sample_rate_hz, spec.features
    feature = np.array([spectrum(one, rate, settings) for one in sensed(wanted)])
    columns = {
        "recording": text_column([f"s/{name}_{number}" for name, number, _ in wanted]),
        "grasp_id": text_column([f"s/{name}_{number}" for name, number, _ in wanted]),
        "object": text_column([name for name, _, _ in wanted]),
    }
    kept = {key: getattr(spec, key).model_dump(mode="json") for key in ("audio", "features")}
    attrs = {"data_set": "d", "source": "simulated", "git_commit": "c0ffee1234567"}
    attrs["settings"] = json_bytes(kept).decode()
    hz = np.fft.rfftfreq(settings.window, 1 / rate)
    write_store(paths.features("d"), Shard(feature, hz, columns, attrs), {})
    train_model(
        paths.features("d"), target="object", kind="classification", unit="", groups="grasp_id",
        model="linear", seed=0, folder=paths.model("d", "sorting", "linear"), task="sorting",
    )  # fmt: skip
    (asked,) = (one for one in asked_of(spec, "sorting") if one.experiment.name == "live_sorting")
    kind = "live_sorting-linear"
    run_experiment(
        paths.features("d"), kind=kind, dataset="d", task="sorting", others={}, paths=paths,
        settings=asked.job_settings(kind), split=spec.task_settings("sorting"), audio=spec.audio,
        features=settings, seed=0, new_grasps=sensed,
        tables=paths.experiment("d", "sorting", kind),
        cost=paths.experiment_cost("d", "sorting", kind),
    )  # fmt: skip
    return paths


def test_two_runs_through_the_card_are_those_of_the_experiment(project):
    command = [sys.executable, PROGRAM, "--project", project.root, "--dataset", "d"]
    done = subprocess.run(
        [*command, "--model", "linear", "--no-noise"],
        check=False,
        capture_output=True,
        text=True,
        timeout=900,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    about, tables = read_tables(project.sort_live)
    runs, stages = tables
    count = len(OBJECTS) * PLACEMENTS
    compared = about["compared"]["1"]
    looks = sum(min(sorts + 1, count) for sorts in runs.column("sorts"))
    assert (compared["looks"], compared["decisions"]) == (looks, looks)
    assert compared["other_decisions"] == 0
    # Without noise, both recordings differ by rounding to 24 bits only, which quiet bins show.
    assert compared["largest"] < 0.01
    experiment = {t.name: t for t in read_tables(project.experiment(
        "d", "sorting", "live_sorting-linear"))[1]}  # fmt: skip
    scaled = experiment["runs"].where(part="scaled", looks=1)
    # But for what is unlike anything seen, which ends a run here alone, they are as long.
    for here, there, reason in zip(
        runs.column("sorts"), scaled.column("sorts"), runs.column("reason"), strict=True
    ):
        assert here == there or (here < there and "unlike" in reason)
    assert len(orders(count, RUNS, about["seed"])) == len(runs.rows)
    times = {row["stage"]: row for row in stages.rows}
    assert {"approach", "sense", "feature and prediction", "decision"} <= set(times)
    assert all(row["median_ms"] <= row["p99_ms"] for row in stages.rows)
    sessions = list(project.data.rglob("session.yaml"))
    assert not sessions  # nothing is added to the data set


def test_without_results_it_says_what_to_make(tmp_path):
    command = [sys.executable, PROGRAM, "--project", tmp_path]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert "live_sorting-cnn.json" in line and "make reproduce" in line
