"""Experiments as the one rule makes them: each only where a task asks for it."""

import csv
import json
import shutil

import pytest
import yaml
from conftest import DECLARATION, EMBEDDING, SESSIONS

from ajgdata.store.tables import read_tables

TASK = {
    "target": "pitch",
    "folds": 3,
    "models": ["knn"],
    "test_on": ["copy"],
    "experiments": {
        "learning_curve": {"groups": [3, 5], "repeats": 3, "models": ["knn"]},
        "cross_gripper": {"test_on": ["copy"], "grasps": [0, 1], "models": ["knn"]},
        "sorting": {"models": ["linear"]},
    },
}

COMPARED = {"title": "T", "question": "Q?", "train": "tones", "task": "pitch", "models": ["knn"]}
VARIANTS = {
    "stft": [
        {"name": "stft:own"},
        {"name": "stft:2048/2048", "features": {"hop": 2048}},
        {"name": "stft:512/512", "features": {"window": 512}},
    ],
    # skipped: these recordings were not simulated
    "sounds": [{"name": "own"}, {"name": "noise", "excitation": {"kind": "mls"}}],
}


@pytest.mark.slow
def test_each_experiment_is_run_where_a_task_asks_for_it(project):
    """`copy` holds the same recordings of the same grasps as `tones`."""
    paths = project.paths
    for session in SESSIONS:
        shutil.copytree(project.folder(session), paths.session("copy", session))
    for name, content in {
        "tones": DECLARATION | {"tasks": {"pitch": TASK}, "embeddings": {"tones": EMBEDDING}},
        "copy": {"name": "copy", "from": "tones", "title": "Second microphone"},
    }.items():
        paths.dataset(name).parent.mkdir(exist_ok=True)
        paths.dataset(name).write_text(yaml.safe_dump(content))
    paths.comparisons.mkdir(parents=True)
    for name, variants in VARIANTS.items():
        file = paths.comparisons / f"{name}.yaml"
        file.write_text(yaml.safe_dump(COMPARED | {"variants": variants}))
    page = ("results/report/index.html", "results/metrics.csv")
    new = {"features": 1, "experiment": 9, "embed": 1}
    assert project.planned(*page) == {**new, "report": 1}
    project.snakemake(*page)

    def tables(kind):
        found = read_tables(paths.experiment("tones", "pitch", kind))[1]
        return {table.name: table for table in found}

    scores = tables("cross_validation-plain")["scores"]
    there, here = (
        scores.where(part=part, statistic="mean").column("value") for part in ("on:copy", "grouped")
    )
    assert there == here
    curve = tables("learning_curve-plain")["curve"].where(metric="accuracy")
    assert len(curve.rows) == 6
    folds = tables("cross_gripper-plain")["folds"].where(grasps=0)
    assert folds.rows and folds.column("home") == folds.column("value")
    pages = sorted(paths.report.parent.rglob("*.html"))
    text = "".join(page.read_text() for page in pages)
    assert "tested on Second microphone" in text
    assert "it needs a virtual data set: other sounds are played in its scenes" in text
    for name in (
        "cross-gripper--tones--pitch",
        "learning-curve--tones--pitch",
        "comparison--tones--pitch--stft",
        "sorting--tones--pitch",
        "embedding-knn--tones--tones",
    ):
        assert f'id="{name}"' in text
    assert project.planned(*page) == {}
    with paths.metrics_table.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    values = {(r["model"], r["part"], r["metric"], r["statistic"]): r["value"] for r in rows}
    assert len(values) == len(rows)
    for fold in range(3):
        (accuracy,) = scores.where(
            part="on:copy", metric="accuracy", statistic=f"fold {fold}"
        ).column("value")
        assert float(values["knn", "on:copy", "accuracy", f"fold {fold}"]) == accuracy
    assert float(values["knn", "curve:5", "accuracy", "draw 2"]) <= 1
    assert float(values["", "cost of training", "cpu_s", "measured"]) > 0
    assert float(values["knn", "cost of stft:512/512", "train_s", "measured"]) > 0
    assert int(values["linear", "sorting, plain", "sorts_in_a_row", "run 0"]) >= 0
    assert float(values["knn", "transfer:copy:1", "accuracy", "fold 0"]) <= 1
    assert {r["source"] for r in rows} == {"recorded"}
    measured = {one["experiment"] for one in json.loads(paths.runs.read_text())["measurements"]}
    assert measured >= {"cross_validation", "comparison", *TASK["experiments"]}
    with paths.predictions.open(newline="") as stream:
        predicted = list(csv.DictReader(stream))
    assert {row["split"] for row in predicted} == {"grouped", "on:copy"}
