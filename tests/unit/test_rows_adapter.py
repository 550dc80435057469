"""Store in, the further experiments' documents out."""

import json

import numpy as np
import pytest

from ajgdata.pipeline.rows import (
    RUNS,
    calibrate_task,
    curve_task,
    energy_task,
    permute_task,
    sort_task,
)
from ajgdata.store.features import Column, Shard, text_column, write_store

OBJECTS = ("ball", "box", "rod")


@pytest.fixture
def store(tmp_path):
    """30 grasps of three objects, two recordings each; the first bins tell the object."""
    rng = np.random.default_rng(0)
    grasp = np.repeat(np.arange(30), 2)
    kind = grasp % 3
    feature = np.exp(rng.normal(size=(30, 60))[grasp] + 0.01 * rng.normal(size=(60, 60)))
    feature[:, :20] *= np.exp(2 * kind[:, np.newaxis] * np.linspace(-1, 1, 20))
    columns = {
        "recording": text_column([f"s/{n}" for n in range(60)]),
        "grasp_id": text_column([f"s/g{n}" for n in grasp]),
        "object": text_column([OBJECTS[k] for k in kind]),
        "size": Column(10.0 * kind, {"units": "mm"}),
    }
    path = tmp_path / "d.nc"
    attrs = {"data_set": "d", "source": "simulated"}
    write_store(path, Shard(feature.astype(np.float32), np.arange(60.0), columns, attrs), {})
    return path


def run(call, store, **changes):
    settings = {
        "target": "object", "kind": "classification", "unit": "", "groups": "grasp_id", "folds": 5,
        "period_deg": None, "withhold": [], "seed": 0, "output": store.parent / "out.json",
    } | changes  # fmt: skip
    call(store, **settings)
    return json.loads(settings["output"].read_bytes())


def test_a_curve(store):
    ask = {"model": "linear", "sizes": [1, 8], "repeats": 3}
    document = run(curve_task, store, **ask)
    assert [(p["groups"], p["repeat"]) for p in document["points"]] == [
        (n, r) for r in range(3) for n in (1, 8)
    ]
    score = {n: [p["scores"]["accuracy"] for p in document["points"] if p["groups"] == n]
             for n in (1, 8)}  # fmt: skip
    assert np.mean(score[1]) < np.mean(score[8])
    assert document["metric"] == "accuracy"
    assert document["provenance"]["source"] == "simulated"
    assert run(curve_task, store, **ask) == document
    many = run(curve_task, store, **ask | {"sizes": [1, 9]})
    assert "up to 9 training groups" in many["skipped"]


def test_a_test_against_chance(store):
    document = run(permute_task, store, permutations=19)
    assert (document["p"], len(document["null"])) == (1 / 20, 19)
    assert document["model"] == "ridge"
    document = run(
        permute_task, store, target="size", kind="regression", permutations=19, withhold=[10.0]
    )
    assert document["metric"] == "rmse"


def test_energies(store):
    ask = {"kind": "classification", "unit": "", "groups": "grasp_id", "reference": "box"}
    energy_task(store, target="object", **ask, band_hz=[5, 20], output=store.parent / "out.json")
    skipped = json.loads((store.parent / "out.json").read_bytes())["skipped"]
    assert "no energy of 'box' to compare with on 'ball'" in skipped  # matched by the object itself


def test_sorting(store):
    document = run(sort_task, store, model="linear", objects=["ball", "rod"], threshold=0.6)
    assert document["recordings"] == 40
    assert len(document["temperatures"]) == 5
    for name in ("plain", "scaled"):
        part = document[name]
        assert len(part["sorts"]) == len(part["mistakes"]) == RUNS
        assert sum(one["count"] for one in part["bins"]) == 40
        assert 0 <= part["accepted"]["share"] <= 1
        assert all(b <= s for b, s in zip(part["before_mistake"], part["sorts"], strict=True))
    assert document["plain"]["accuracy"] == document["scaled"]["accuracy"]
    assert "skipped" in run(sort_task, store, model="linear", objects=["x", "rod"], threshold=0.6)
    assert (
        "no probabilities"
        in run(sort_task, store, model="svm", objects=["ball", "rod"], threshold=0.6)["skipped"]
    )


def test_other_grippers(store):
    others = {"again": store}
    document = run(calibrate_task, store, model="linear", others=others, grasps=[0, 8])
    assert document["metric"] == "accuracy"
    points = document["on"]["again"]
    assert [(p["fold"], p["grasps"]) for p in points] == [(f, n) for f in range(5) for n in (0, 8)]
    # the same recordings: what is tested at home and there is the same
    assert all(p["home"] == p["scores"] for p in points if not p["grasps"])
    assert "8 that are not tested" in run(
        calibrate_task, store, model="linear", others=others, grasps=[9]
    )["skipped"]  # fmt: skip
    number = {"target": "size", "kind": "regression", "unit": "mm", "withhold": [10.0]}
    document = run(calibrate_task, store, **number, model="knn", others=others, grasps=[1])
    assert {p["recordings"] for p in document["on"]["again"]} == {4}  # two values, two samples
