"""The paper's further experiments as the workflow makes them: each only where a task asks."""

import csv
import json
import shutil

import yaml
from conftest import DECLARATION, SESSIONS

TASK = {
    "target": "pitch",
    "folds": 3,
    "models": ["knn"],
    "test_on": ["copy"],
    "curve": {"groups": [3, 5], "repeats": 3, "models": ["knn"]},
    "permutations": 5,
    "calibrate": {"test_on": ["copy"], "grasps": [0, 1], "models": ["knn"]},
    "stft": {"settings": [{"hop": 2048}, {"window": 512}], "models": ["knn"]},
    "sorting": {"objects": ["high", "low"], "models": ["linear"]},
}


def test_each_experiment_is_run_where_a_task_asks_for_it(project):
    """`copy` holds the same recordings of the same grasps as `tones`."""
    paths = project.paths
    for session in SESSIONS:
        shutil.copytree(project.folder(session), paths.session("copy", session))
    for name, content in {
        "tones": DECLARATION | {"tasks": {"pitch": TASK}},
        "copy": {"name": "copy", "from": "tones", "title": "Second microphone"},
    }.items():
        paths.dataset(name).parent.mkdir(exist_ok=True)
        paths.dataset(name).write_text(yaml.safe_dump(content))
    page = ("results/report/index.html", "results/metrics.json")
    new = {"features": 2, "merge": 1, "curve": 1, "permute": 1, "sort": 1, "stft": 1}
    new["calibrate"] = 1
    assert project.planned(*page) == {**new, "evaluate": 1, "report": 1, "collect": 1}
    project.snakemake(*page)
    found = json.loads(paths.metrics("tones", "pitch", "knn").read_text())
    assert found["on:copy"]["per_fold"] == found["grouped"]["per_fold"]
    assert len(json.loads(paths.curve("tones", "pitch", "knn").read_text())["points"]) == 6
    assert len(json.loads(paths.permutations("tones", "pitch").read_text())["null"]) == 5
    assert json.loads(paths.sorting("tones", "pitch", "linear").read_text())["recordings"] == 16
    points = json.loads(paths.transfer("tones", "pitch", "knn").read_text())["on"]["copy"]
    assert all(p["home"] == p["scores"] for p in points if not p["grasps"])
    text = paths.report.read_text()
    assert "tested on Second microphone" in text
    assert "Permutation test" in text
    for name in (
        "transfer--tones--pitch",
        "curve--tones--pitch",
        "stft--tones--pitch",
        "chance--tones--pitch",
        "sorting--tones--pitch--linear",
    ):
        assert f'id="{name}"' in text
    assert project.planned(*page) == {}
    with paths.metrics_table.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    values = {(r["model"], r["part"], r["metric"], r["statistic"]): r["value"] for r in rows}
    assert len(values) == len(rows)
    for fold, accuracy in enumerate(found["on:copy"]["per_fold"]["accuracy"]):
        assert float(values["knn", "on:copy", "accuracy", f"fold {fold}"]) == accuracy
    assert float(values["knn", "curve:5", "accuracy", "draw 2"]) <= 1
    assert float(values["knn", "stft:2048/2048", "accuracy", "mean"]) <= 1
    assert float(values["knn", "cost of stft:512/512", "train_s", "measured"]) > 0
    assert float(values["ridge", "permutations", "p", "of 5"]) >= 1 / 6
    assert int(values["linear", "sorting, plain", "sorts_in_a_row", "run 0"]) >= 0
    assert float(values["knn", "transfer:copy:1", "accuracy", "fold 0"]) <= 1
    assert {r["source"] for r in rows} == {"recorded"}
    document = json.loads(paths.all_metrics.read_text())
    (evaluation,) = document["evaluations"]
    assert evaluation["on:copy"] == found["on:copy"]
    assert evaluation["cost"]["grouped"]["train_s"] > 0
    kinds = ("curves", "permutations", "sorting", "transfers", "energies")
    assert [len(document[kind]) for kind in kinds] == [1, 1, 1, 1, 0]


def test_an_experiment_that_cannot_be_made_says_why_and_stops_nothing(project):
    task = {"target": "pitch", "folds": 3, "models": ["knn"]}
    task |= {"curve": {"groups": [1, 99], "models": ["linear"]}}
    paths = project.paths
    paths.dataset("tones").write_text(yaml.safe_dump(DECLARATION | {"tasks": {"pitch": task}}))
    project.snakemake("results/report/index.html")
    text = paths.report.read_text()
    assert "pitch, learning curve" in text
    assert "a curve up to 99 training groups per class: a class has" in text
