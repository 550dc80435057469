"""Every declared experiment, on made-up spectra with its recipe's own grasps and labels.

What is made up is the sound: a spectrum that tells the label a little, and the grasp. Everything
else is the project's: data sets, labels, groups, tasks and settings as they are declared.
"""

import csv
import hashlib
import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from ajgdata.paths import Paths
from ajgdata.pipeline.evaluate import evaluate_task
from ajgdata.pipeline.recipes import planned_grasps, recipe_sessions
from ajgdata.pipeline.rows import (
    calibrate_task,
    curve_task,
    energy_task,
    permute_task,
    sort_task,
)
from ajgdata.store.features import Column, Shard, text_column, write_store
from ajgdata.store.sessions import list_datasets, read_dataset

PATHS = Paths(Path(__file__).resolve().parents[2])
SPECS = {name: read_dataset(PATHS, name) for name in list_datasets(PATHS)}
MADE = [name for name, spec in SPECS.items() if spec.recipe]
TASKS = [(name, task) for name in MADE for task in SPECS[name].tasks]
EVALUATED = [(d, t) for d, t in TASKS if SPECS[d].tasks[t].models]
HZ = np.linspace(0, 20_000, 24)
#: Of the same kind of result as every other model, at a fraction of the time.
MODEL = "ridge"
SHARES = ("accuracy", "balanced_accuracy", "macro_f1")


def shape_of(text: str) -> np.ndarray:
    """A spectrum (24,) that the text decides."""
    seed = int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "big")
    return np.random.default_rng(seed).normal(size=len(HZ))


@cache
def table(name: str) -> list[dict[str, object]]:
    """One row a recording of a recipe: its names, group and labels."""
    rows = []
    sessions = recipe_sessions(PATHS, name)
    planned = planned_grasps(PATHS.dataset(name), SPECS[name], sessions)
    for session, grasps in zip(sessions, planned, strict=True):
        for grasp in grasps:
            if not grasp.object:
                continue  # a reference: nothing is held, nothing is to be told
            medium = grasp.setup.get("medium", {}).get("kind", "plastic")
            labels = {"object": grasp.object, "medium": medium, **grasp.targets}
            for sample in range(grasp.samples):
                names = {"recording": f"{session}/{grasp.grasp_id}_{sample}"}
                rows.append(names | {"grasp_id": f"{session}/{grasp.grasp_id}"} | labels)
    return rows


@pytest.fixture(scope="session")
def stores(tmp_path_factory) -> dict[str, Path]:
    """A store of every data set that has a recipe."""
    folder = tmp_path_factory.mktemp("stores")
    return {name: write(folder / f"{name}.nc", name) for name in MADE}


def write(path: Path, name: str) -> Path:
    rows, targets = table(name), SPECS[name].targets
    columns = {key: text_column([str(r[key]) for r in rows]) for key in ("recording", "grasp_id")}
    columns["object"] = text_column([str(r["object"]) for r in rows])
    level = np.zeros((len(rows), len(HZ)))
    for target, declared in targets.items():
        values = [row[target] for row in rows]
        if declared.kind == "regression":
            number = np.asarray(values, float)
            columns[target] = Column(number, {"units": declared.unit})
            level += np.outer((number - number.mean()) / number.std(), shape_of(target))
        else:
            columns[target] = text_column([str(value) for value in values])
            level += [0.5 * shape_of(str(value)) for value in values]
    level += [shape_of(str(row["grasp_id"])) for row in rows]
    level += [0.02 * shape_of(str(row["recording"])) for row in rows]
    attrs = {"data_set": name, "source": "simulated", "git_commit": "", "settings": "{}"}
    write_store(path, Shard(np.exp(level).astype(np.float32), HZ, columns, attrs), {})
    return path


def evaluated(stores: dict[str, Path], name: str, task: str, folder: Path) -> tuple[Path, Path]:
    settings = SPECS[name].evaluation(task)
    others = {other: stores[other] for other in settings.pop("test_on")}
    out = {key: folder / key for key in ("metrics", "predictions", "cost")}
    evaluate_task(stores[name], **settings, others=others, model=MODEL, seed=0, **out)
    return out["metrics"], out["predictions"]


@pytest.mark.parametrize("name", MADE)
def test_labels_are_complete_and_of_one_value_a_grasp(name):
    rows = table(name)
    assert len({row["recording"] for row in rows}) == len(rows)
    for target in SPECS[name].targets:
        labels = {(row["grasp_id"], row[target]) for row in rows}
        assert not {label for _, label in labels} & {None, ""}
        assert len(labels) == len({grasp for grasp, _ in labels})
        assert len({label for _, label in labels}) > 1


@pytest.mark.parametrize(("name", "task"), EVALUATED)
def test_each_task_is_evaluated_without_leaks_within_bounds_and_twice_the_same(
    stores, tmp_path, name, task
):
    metrics, predictions = evaluated(stores, name, task, tmp_path / "1")
    again = evaluated(stores, name, task, tmp_path / "2")
    assert [path.read_bytes() for path in (metrics, predictions)] == [
        path.read_bytes() for path in again
    ]
    document = json.loads(metrics.read_text())
    assert "skipped" not in document
    check_bounds(document, SPECS[name].tasks[task].folds)
    with predictions.open(newline="") as stream:
        lines = list(csv.DictReader(stream))
    check_groups(name, task, lines)


def check_bounds(document: dict, folds: int) -> None:
    parts = {k: v for k, v in document.items() if isinstance(v, dict) and "per_fold" in v}
    assert len(parts["grouped"]["per_fold"]) == 3
    for part in parts.values():
        for metric, values in part["per_fold"].items():
            assert 1 <= len(values) <= folds
            for value in values:
                if metric in SHARES:
                    assert 0 <= value <= 1
                elif metric in ("rmse", "mae"):
                    assert value >= 0
                    assert not document["period"] or value <= document["period"] / 2
                else:
                    assert value is None or value <= 1  # r2


def check_groups(name: str, task: str, lines: list[dict[str, str]]) -> None:
    settings = SPECS[name].tasks[task]
    group = {row["recording"]: row["grasp_id"] for row in table(name)}
    value = {row["recording"]: row[settings.target] for row in table(name)}
    fold_of: dict[object, str] = {}
    seen = [line["recording"] for line in lines if line["split"] == "grouped"]
    withheld = set(settings.withhold)
    assert sorted(seen) == sorted(r for r in value if value[r] not in withheld)
    for line in lines:
        if line["split"] == "grouped":
            assert fold_of.setdefault(group[line["recording"]], line["fold"]) == line["fold"]
        if line["split"] == "withheld":
            assert value[line["recording"]] in withheld
    for other in settings.test_on:
        theirs = {row["recording"]: row["grasp_id"] for row in table(other)}
        for line in lines:
            if line["split"] == f"on:{other}":
                grasp = theirs[line["recording"]]
                assert fold_of.get(grasp, line["fold"]) == line["fold"]


def further(name: str, task: str) -> list[tuple]:
    """The further experiments of a task, smaller than declared where that takes long."""
    spec = SPECS[name]
    settings, seeded = spec.tasks[task], spec.experiment(task) | {"seed": 0}
    made = []
    if settings.curve:
        sizes = settings.curve.groups[:: len(settings.curve.groups) - 1]
        more = {"model": MODEL, "sizes": sizes, "repeats": 2}
        made.append(("curve", curve_task, seeded | more))
    if settings.permutations:
        made.append(("permutations", permute_task, seeded | {"permutations": 5}))
    if settings.sorting:
        more = settings.sorting.model_dump(include={"objects", "threshold"}) | {"model": "linear"}
        made.append(("sorting", sort_task, seeded | more))
    if settings.calibrate:
        grasps = settings.calibrate.grasps[:: len(settings.calibrate.grasps) - 1]
        on = {"others": settings.calibrate.test_on, "grasps": grasps, "model": MODEL}
        made.append(("transfer", calibrate_task, seeded | on))
    if settings.energy:
        made.append(("energy", energy_task, spec.labelled(task) | settings.energy.model_dump()))
    return made


FURTHER = [(d, t, *one) for d, t in TASKS for one in further(d, t)]


@pytest.mark.parametrize(
    ("name", "kind", "call", "settings"),
    [(d, kind, call, settings) for d, _, kind, call, settings in FURTHER],
    ids=[f"{d}-{t}-{kind}" for d, t, kind, *_ in FURTHER],
)
def test_each_further_experiment_is_made_within_bounds_and_twice_the_same(
    stores, tmp_path, name, kind, call, settings
):
    paths = tmp_path / "1.json", tmp_path / "2.json"
    if "others" in settings:
        settings = settings | {"others": {other: stores[other] for other in settings["others"]}}
    for path in paths:
        call(stores[name], **settings, output=path)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    document = json.loads(paths[0].read_text())
    assert "skipped" not in document
    if kind == "curve":
        scores = [point["scores"][document["metric"]] for point in document["points"]]
        assert len(scores) == 4
        assert all(0 <= score <= 1 for score in scores)
    elif kind == "permutations":
        assert 1 / 6 <= document["p"] <= 1
        assert all(0 <= value <= 1 for value in (document["value"], *document["null"]))
    elif kind == "sorting":
        for part in (document["plain"], document["scaled"]):
            assert 0 <= part["accuracy"] <= 1
            assert 0 <= part["accepted"]["share"] <= 1
    elif kind == "transfer":
        assert set(document["on"]) == set(settings["others"])
        for points in document["on"].values():
            assert [p["grasps"] for p in points] == [*settings["grasps"]] * settings["folds"]
            # of each class as many recordings as grasps: the other grippers are recorded once
            classes = {p["recordings"] / p["grasps"] for p in points if p["grasps"]}
            assert len(classes) == 1
            score = [p["scores"][document["metric"]] for p in points]
            assert all(s >= 0 and (document["kind"] == "regression" or s <= 1) for s in score)
            assert all(bool(p["home"]) == (p["grasps"] == 0) for p in points)
    else:
        energies = {part["label"]: part["mean"] for part in document["parts"]}
        assert energies[settings["reference"]] == pytest.approx(1)
        assert all(energy > 0 for energy in energies.values())


def test_settings_of_the_stft_can_be_made_of_what_a_recipe_records():
    for name, task in TASKS:
        rate_hz = SPECS[name].audio.sample_rate_hz
        for one in SPECS[name].feature_variants(task):
            assert one.hop <= one.window <= rate_hz  # recordings last a second
            assert not one.align


def test_every_experiment_is_looked_at_here():
    kinds = {kind for _, _, kind, *_ in FURTHER}
    assert kinds == {"curve", "permutations", "sorting", "transfer", "energy"}
    assert {d for d, _ in TASKS} | {o for d, t in TASKS for o in SPECS[d].tasks[t].others} <= set(
        MADE
    )
