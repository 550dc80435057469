"""Store in, metrics, predictions and cost out; what cannot be evaluated is said."""

import csv
import dataclasses
import json

import numpy as np
import pytest

from ajgdata.pipeline.evaluate import evaluate_task
from ajgdata.store.features import Column, Shard, read_store, text_column, write_store
from ajgdata.store.tables import plain


@pytest.fixture
def store(tmp_path):
    """40 recordings of 10 grasps; the first 100 bins tell the size, the other 300 the class."""
    generator = np.random.default_rng(0)
    grasp = np.repeat(np.arange(10), 4)
    size = 10.0 + grasp
    feature = generator.uniform(0.99, 1.01, (40, 400)).astype(np.float32)
    feature[:, :100] *= size[:, np.newaxis]
    feature[:, 100:] *= 1 + grasp[:, np.newaxis] % 2
    missing = np.arange(40) < 4
    path = tmp_path / "d.nc"
    write_store(
        path,
        Shard(
            feature,
            np.arange(400.0),
            {
                "recording": text_column([f"s/{n:02d}" for n in range(40)]),
                "grasp_id": text_column([f"s/g{n}" for n in grasp]),
                "edge_mm": Column(np.where(missing, np.nan, size), {"units": "mm"}),
                "kind": text_column(
                    [
                        "" if m else ("even", "odd")[g % 2]
                        for m, g in zip(missing, grasp, strict=True)
                    ]
                ),
                "constant": Column(np.full(40, 3.0)),
                "huge": Column(1e300 * size),  # its square is infinite
                "tiny": Column(1e-300 * size),  # its square is zero
                "never": Column(np.full(40, np.nan)),
                "one_group": text_column(["x"] * 40),
                "some_group": text_column(["" if n == 20 else "x" for n in range(40)]),
            },
            {"data_set": "d", "source": "recorded"},
        ),
        {"units": "1"},
    )
    return path


def run(store, name="out", **changes):
    folder = store.parent / name
    settings = {
        "target": "edge_mm", "kind": "regression", "unit": "mm", "groups": "grasp_id", "folds": 3,
        "model": "linear", "compare_random": False, "seed": 0,
    } | changes  # fmt: skip
    evaluate_task(
        store,
        **settings,
        metrics=folder / "metrics.json",
        cost=folder / "cost.json",
        predictions=folder / "predictions.csv",
    )
    with (folder / "predictions.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    return json.loads((folder / "metrics.json").read_bytes()), rows, folder


def test_regression(store):
    document, rows, folder = run(store)
    assert document["grouped"]["recordings"] == 36  # those whose target is missing are left out
    assert document["grouped"]["groups"] == 9
    assert len(rows) == 36
    assert rows[0]["recording"] == "s/04"
    errors = [float(r["y_pred"]) - float(r["y_true"]) for r in rows]
    rmse = np.sqrt(np.mean(np.square(errors)))
    assert document["grouped"]["pooled"]["rmse"] == pytest.approx(rmse, rel=1e-9)
    assert rmse < document["grouped"]["chance"]["rmse"] / 2
    assert {r["split"] for r in rows} == {"grouped"}
    folds = {r["recording"]: r["fold"] for r in rows}
    for first in range(4, 40, 4):  # the four recordings of a grasp share their fold
        assert len({folds[f"s/{n:02d}"] for n in range(first, first + 4)}) == 1
    assert document["provenance"]["source"] == "recorded"
    assert (document["unit"], document["target"], document["model"]) == ("mm", "edge_mm", "linear")
    assert json.loads((folder / "cost.json").read_bytes())["grouped"]["train_s"] > 0


def test_classification_beside_a_random_split(store):
    document, rows, _ = run(
        store, target="kind", kind="classification", unit="", model="knn", compare_random=True
    )
    assert document["grouped"]["pooled"]["accuracy"] == 1.0
    assert document["grouped"]["classes"] == ["even", "odd"]
    assert document["random"]["groups"] == 36
    assert [r["split"] for r in rows] == ["grouped"] * 36 + ["random"] * 36
    assert all(0.5 <= float(r["probability"]) <= 1 for r in rows)


@pytest.mark.parametrize("model", ["linear", "knn"])
def test_same_bytes_twice(store, model):
    folders = [run(store, name, model=model, compare_random=True)[2] for name in ("one", "two")]
    for name in ("metrics.json", "predictions.csv"):
        assert (folders[0] / name).read_bytes() == (folders[1] / name).read_bytes()


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        (
            {"groups": "one_group"},
            "all recordings have the same 'one_group': folds need at least two",
        ),
        (
            {"target": "one_group", "kind": "classification"},
            "every recording has the same 'one_group': there is nothing to tell apart",
        ),
        (
            {"target": "constant"},
            "every recording has the same 'constant': there is nothing to tell apart",
        ),
        (
            {"target": "huge"},
            "errors of 'huge' are too large or too small to compute with: give it in another unit",
        ),
        (
            {"target": "tiny"},
            "errors of 'tiny' are too large or too small to compute with: give it in another unit",
        ),
        ({"target": "nope"}, "there is no column 'nope': add it to recordings.csv"),
        ({"groups": "nope"}, "there is no column 'nope': add it to recordings.csv"),
        ({"target": "never"}, "no recording has a value of 'never'"),
        ({"groups": "some_group"}, "recording 's/20' has no 'some_group', which groups folds"),
    ],
)
def test_what_cannot_be_evaluated_is_written_with_the_reason(store, changes, reason):
    document, rows, folder = run(store, **changes)
    assert document["skipped"] == reason
    assert "grouped" not in document
    assert rows == []
    assert (folder / "predictions.csv").read_text().startswith("recording,split,fold,y_true")
    assert json.loads((folder / "cost.json").read_bytes()) == {}


def test_fewer_groups_than_folds_make_a_fold_of_each_group(store):
    document, rows, _ = run(store, folds=10)
    assert document["grouped"]["folds"] == document["grouped"]["groups"] == 9
    assert len({row["fold"] for row in rows}) == 9


def test_plain():
    value = {"a": (np.float64("nan"), np.int64(3)), 2: [np.inf, np.str_("x"), None, True]}
    assert plain(value) == {"a": [None, 3], "2": [None, "x", None, True]}


def test_a_store_without_recordings_is_said(tmp_path):
    path = tmp_path / "d.nc"
    columns = {"recording": text_column([])}
    write_store(path, Shard(np.empty((0, 3), np.float32), np.arange(3.0), columns, {}), {})
    assert run(path)[0]["skipped"] == "no recording can be used: the quarantine says why"


def test_withheld_values_are_trained_on_by_no_fold_and_predicted_by_all(store):
    document, rows, _ = run(store, withhold=[13.0, 17.0])
    assert document["withhold"] == [13, 17]
    assert document["grouped"]["recordings"] == 36 - 8
    known = [r for r in rows if r["split"] == "grouped"]
    new = [r for r in rows if r["split"] == "withheld"]
    assert {r["y_true"] for r in new} == {"13.0", "17.0"}
    assert not {r["y_true"] for r in known} & {"13.0", "17.0"}
    assert sorted(r["fold"] for r in new) == ["0"] * 8 + ["1"] * 8 + ["2"] * 8
    for fold, rmse in enumerate(document["withheld"]["per_fold"]["rmse"]):
        mine = [r for r in new if r["fold"] == str(fold)]
        errors = [float(r["y_pred"]) - float(r["y_true"]) for r in mine]
        assert rmse == pytest.approx(np.sqrt(np.mean(np.square(errors))))
    low, high = sorted((document["grouped"]["mean"]["rmse"], document["withheld"]["mean"]["rmse"]))
    assert 0.9 * low < document["overall"]["mean"]["rmse"] < 1.1 * high
    assert document["overall"]["recordings"] == 36
    assert [v["value"] for v in document["by_value"] if v["withheld"]] == [13, 17]
    assert sum(v["recordings"] for v in document["by_value"]) == 36


@pytest.mark.parametrize(
    ("withhold", "problem"),
    [([12.5], "no recording has the value 12.5"), (np.arange(11.0, 19), "at least two values")],
)
def test_what_cannot_be_withheld_is_said(store, withhold, problem):
    assert problem in run(store, withhold=withhold)[0]["skipped"]


def test_a_target_that_repeats_is_judged_the_shortest_way_round(store):
    document, rows, _ = run(store, period_deg=10.0)
    assert document["period"] == 10
    assert all(0 <= float(r["y_pred"]) < 10 for r in rows)
    assert max(document["grouped"]["per_fold"]["mae"]) <= 5  # half a period


def test_other_stores_are_tested_without_a_grasp_on_both_sides(store, tmp_path):
    """A copy of the store: each recording is predicted once, by the fold that holds its grasp out,
    hence as well as the original; and one with further grasps, which every fold predicts."""
    shard = read_store(store)
    new = {**shard.columns, "grasp_id": text_column([f"t/{n}" for n in range(40)])}
    write_store(tmp_path / "new.nc", dataclasses.replace(shard, columns=new), {"units": "1"})
    others = {"copy": store, "new": tmp_path / "new.nc"}
    document, rows, _ = run(store, others=others, withhold=[15.0])
    assert document["on:copy"]["per_fold"] == document["grouped"]["per_fold"]
    assert document["on:copy"]["recordings"] == 32  # without the missing, and the withheld value
    fold = {r["recording"]: r["fold"] for r in rows if r["split"] == "grouped"}
    assert {r["recording"]: r["fold"] for r in rows if r["split"] == "on:copy"} == fold
    assert len([r for r in rows if r["split"] == "on:new"]) == 3 * 32
    narrow = dataclasses.replace(
        shard, feature=shard.feature[:, :300], frequency_hz=shard.frequency_hz[:300]
    )
    write_store(tmp_path / "narrow.nc", narrow, {"units": "1"})
    told = run(store, others=others, silent=["new"])[0]["silent"]
    assert list(told) == ["new"]  # nothing is silent there: the models hear the target
    assert told["new"]["flagged"] and told["new"]["p"] == 1 / 1000
    skipped = run(store, others={"narrow": tmp_path / "narrow.nc"})[0]["skipped"]
    assert "on:narrow has 300 features, not 400" in skipped
