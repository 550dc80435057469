"""Experiments as the one rule makes them: each only where a task asks for it."""

import json
import shutil

import pytest
import yaml
from conftest import DECLARATION, EMBEDDING, SESSIONS

import ajgdata
from ajgdata.store.files import read_csv
from ajgdata.store.metrics import KEYS
from ajgdata.store.tables import read_measurements

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
    "stft": {
        "stft:own": {},
        "stft:2048/2048": {"features": {"hop": 2048}},
        "stft:512/512": {"features": {"window": 512}},
    },
    # skipped: these recordings were not simulated
    "sounds": {"own": {}, "noise": {"excitation": {"kind": "mls"}}},
}


FIGURES = (
    "cross-gripper--tones--pitch",
    "learning-curve--tones--pitch",
    "variants--tones--pitch--stft",
    "sorting--tones--pitch",
    "tones--tones--accuracy-against-dimension",
)


def declare(project) -> None:
    """Add `copy`, which holds the same recordings of the same grasps as `tones`."""
    paths = project.paths
    for session in SESSIONS:
        shutil.copytree(project.folder(session), paths.session("copy", session))
    for name, content in {
        "tones": DECLARATION | {"tasks": {"pitch": TASK}, "embeddings": {"tones": EMBEDDING}},
        "copy": {"name": "copy", "from": "tones", "title": "Second microphone"},
    }.items():
        paths.dataset(name).parent.mkdir(exist_ok=True)
        paths.dataset(name).write_text(yaml.safe_dump(content))
    paths.variants.mkdir(parents=True)
    for name, variants in VARIANTS.items():
        file = paths.variants / f"{name}.yaml"
        file.write_text(yaml.safe_dump(COMPARED | {"variants": variants}))


def check_metrics(paths, scores) -> None:
    metrics = ajgdata.load_metrics(project=paths.root)
    assert not metrics.duplicated([*KEYS]).any() and set(metrics["source"]) == {"recorded"}

    def value(experiment: str, metric: str, statistic: str, **key: object) -> float:
        named = {"experiment": experiment, "metric": metric, "statistic": statistic} | key
        rows = metrics
        for column, cell in named.items():
            rows = rows[rows[column] == cell]
        (number,) = rows["value"]
        return number

    on_copy = scores.where(test_set="copy", metric="accuracy")
    knn = {"model": "knn", "test_set": "copy"}
    for fold in range(3):
        (accuracy,) = on_copy.where(statistic=f"fold {fold}").column("value")
        assert value("cross_validation", "accuracy", f"fold {fold}", **knn) == accuracy
    assert value("learning_curve", "accuracy", "draw 2", model="knn", grasps=5) <= 1
    assert value("embedding_knn", "cpu_s", "cost") > 0
    stft = {"comparison": "stft", "condition": "stft:512/512", "model": "knn"}
    assert value("variants", "train_cpu_s", "cost", **stft) > 0
    sorts = value("sorting", "sorted_until_refusal", "run 0", model="linear", condition="plain")
    assert sorts >= 0 and sorts == int(sorts)
    assert value("cross_gripper", "accuracy", "fold 0", grasps=1, **knn) <= 1


@pytest.mark.slow
def test_each_experiment_is_run_where_a_task_asks_for_it(project):
    paths = project.paths
    declare(project)
    page = ("results/report/index.html", "results/metrics.csv")
    assert project.planned(*page) == {
        "features": 1,
        "experiment": 9,
        "embed": 1,
        "collect": 1,
        "report": 1,
    }
    project.snakemake(*page)

    def table(experiment, name):
        file = paths.experiment("tones", "pitch", experiment, "plain")
        ((_, tables),) = read_measurements(file)
        return next(table for table in tables if table.name == name)

    scores = table("cross_validation", "scores")
    means = scores.where(statistic="mean", split="grouped").split_by("test_set")
    assert means["copy"].column("value") == means["tones"].column("value")
    assert len(table("learning_curve", "curve").where(metric="accuracy").rows) == 6
    folds = table("cross_gripper", "folds").where(grasps=0)
    assert folds.rows and folds.column("home") == folds.column("value")
    text = "".join(page.read_text() for page in sorted(paths.report.parent.rglob("*.html")))
    assert "tested on Second microphone" in text
    assert "it needs a virtual data set: other sounds are played in its scenes" in text
    assert all(f'id="{name}"' in text for name in FIGURES)
    assert project.planned(*page) == {}
    check_metrics(paths, scores)
    measured = {item["experiment"] for item in json.loads(paths.runs.read_text())["measurements"]}
    assert measured >= {"cross_validation", "variants", *TASK["experiments"]}
    assert {row["test_set"] for row in read_csv(paths.predictions)[1]} == {"tones", "copy"}
