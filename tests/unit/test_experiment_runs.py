"""From a store to an experiment's files, and from these to the report and the table of results."""

import csv
import dataclasses
import json

import numpy as np
import pytest
from experiment_samples import small_store
from worlds import AUDIO, FEATURES

from ajgdata.evaluate.crossval import cross_validate
from ajgdata.evaluate.task_data import task_data
from ajgdata.experiments import EXPERIMENTS, Asked
from ajgdata.experiments.base import Inputs
from ajgdata.experiments.stft_settings import features_of
from ajgdata.paths import Paths
from ajgdata.pipeline.collect import collect
from ajgdata.pipeline.experiments import asked_for, read_results, run_experiment
from ajgdata.pipeline.recordings import RecordingReader
from ajgdata.store.features import write_store
from ajgdata.store.tables import read_tables
from ajgdata.types import DatasetSpec

SPLIT = {
    "target": "object", "kind": "classification", "unit": "", "groups": "grasp_id", "folds": 5,
    "withhold": [], "period_deg": None,
}  # fmt: skip
SPEC = DatasetSpec.model_validate(
    {
        "name": "d",
        "targets": {"object": {"kind": "classification"}},
        "tasks": {
            "t": {
                "target": "object",
                "models": ["linear_plain"],
                "experiments": {
                    "learning_curve": {"groups": [1, 99], "models": ["knn"]},
                },
            }
        },
    }
)


def run(paths: Paths, asked: Asked, **changes) -> None:
    for kind in asked.kinds:
        ask = {
            "kind": kind, "dataset": "d", "task": "t", "split": SPLIT,
            "settings": asked.settings.model_dump(mode="json"), "others": {}, "audio": SPEC.audio,
            "features": SPEC.features, "paths": paths, "seed": 3,
            "tables": paths.experiment("d", "t", kind),
            "cost": paths.experiment_cost("d", "t", kind),
        } | changes  # fmt: skip
        run_experiment(paths.features("d"), **ask)


@pytest.fixture(scope="module")
def paths(tmp_path_factory):
    made = Paths(tmp_path_factory.mktemp("project"))
    write_store(made.features("d"), small_store(), {})
    for asked in asked_for({"d": SPEC}, [("d", "t")]):
        run(made, asked)
    return made


def test_a_task_says_how_many_recordings_a_model_learns_from(tmp_path):
    made = Paths(tmp_path)
    write_store(made.features("d"), small_store(), {})
    asked = next(one for one in asked_for({"d": SPEC}, [("d", "t")]) if "-" in one.kinds[0])
    kind, table = asked.kinds[0], made.experiment("d", "t", asked.kinds[0])
    run(made, asked, split=SPLIT | {"most_recordings": {"linear": 10}})
    scores = next(one for one in read_tables(table)[1] if one.name == "scores")
    told = {row["metric"]: row["value"] for row in scores.where(part="training of grouped").rows}
    assert kind == "cross_validation-linear_plain"
    assert told["trained_on"] == 10 < told["available"]


def collected(paths: Paths) -> tuple[dict, list[dict[str, str]], list[dict[str, str]]]:
    asked = asked_for({"d": SPEC}, [("d", "t")])
    documents = [("d", "t", kind) for one in asked for kind in one.kinds]
    out = {"document": paths.all_metrics, "table": paths.metrics_table}
    collect(paths, documents, **out, predictions=paths.predictions)
    rows = [
        list(csv.DictReader(path.read_text().splitlines()))
        for path in (paths.metrics_table, paths.predictions)
    ]
    return json.loads(paths.all_metrics.read_text()), *rows


def test_files_say_what_was_measured_how_and_of_what(paths):
    about, tables = read_tables(paths.experiment("d", "t", "cross_validation-linear_plain"))
    assert about["settings"]["models"] == ["linear_plain"]
    assert (about["seed"], about["provenance"]["data_set"]) == (3, "d")
    assert tables[0].name == "scores"


def test_a_task_that_lacks_what_an_experiment_needs_is_skipped_with_the_reason(paths):
    *_, curve = (one for one in asked_for({"d": SPEC}, [("d", "t")]) if "curve" in one.kinds[0])
    results, skipped = read_results(paths, curve, {"d": SPEC}, {})
    assert results.results == ()
    ((label, reason),) = skipped
    assert label == "k-NN"
    assert "99 training groups per class" in reason


def test_a_mistake_in_the_code_is_no_reason_to_skip(paths, monkeypatch):
    def mistaken(*_):
        raise ValueError("operands could not be broadcast together")

    asked = asked_for({"d": SPEC}, [("d", "t")])[1]
    wrong = dataclasses.replace(asked.experiment, measure=mistaken)
    monkeypatch.setitem(EXPERIMENTS.own, asked.experiment.name, wrong)
    with pytest.raises(ValueError, match="broadcast"):
        run(paths, asked, tables=paths.root / "t.json", cost=paths.root / "c.json")
    assert not (paths.root / "t.json").exists()


def test_every_number_has_a_row_with_its_seed_and_what_made_it(paths):
    document, rows, predictions = collected(paths)
    linear = [r for r in rows if r["model"] == "linear_plain" and r["part"] == "grouped"]
    values = {r["statistic"]: float(r["value"]) for r in linear if r["metric"] == "accuracy"}
    folds = [values[f"fold {n}"] for n in range(5)]
    assert values["mean"] == pytest.approx(np.mean(folds), abs=1e-15)
    assert values["sd"] == pytest.approx(np.std(folds, ddof=1), abs=1e-15)
    assert {(r["source"], r["seed"]) for r in rows} == {("simulated", "3")}
    assert any(r["part"] == "cost of grouped" and r["statistic"] == "measured" for r in rows)
    keys = [tuple(v for k, v in row.items() if k != "value") for row in rows]
    assert len(set(keys)) == len(keys)
    once = [p for p in predictions if p["split"] == "grouped"]  # so few are split again as well
    assert len(once) == 60
    right = np.mean([p["y_true"] == p["y_pred"] for p in once])
    assert right == pytest.approx(values["pooled"])
    kinds = {one["experiment"] for one in document["experiments"]}
    assert kinds == {"cross_validation", "learning_curve"}


# Settings of the STFT need the recordings themselves

SETTINGS = [
    FEATURES,
    FEATURES.model_copy(update={"window": 512, "hop": 512}),
    FEATURES.model_copy(update={"band_hz": (0.0, 2000.0)}),
]
CHANGES = [{"window": 512, "hop": 512}, {"band_hz": [0, 2000]}]
EDGES = {
    "target": "edge_mm", "kind": "regression", "unit": "mm", "groups": "grasp_id", "folds": 3,
    "period_deg": None, "withhold": [],
}  # fmt: skip


@pytest.fixture
def store(project):
    project.session(tones={f"t{n}": 400.0 + 100 * n for n in range(12)})
    project.shard()
    project.merge("s1")
    return project


def stft(project, changes=CHANGES, features=FEATURES):
    tables, cost = project.root / "stft.json", project.root / "cost.json"
    run_experiment(
        project.paths.features("d"), kind="stft_settings", dataset="d", task="edge",
        settings={"settings": changes, "models": ["ridge", "linear"]}, split=EDGES, others={},
        audio=AUDIO, features=features, paths=project.paths, seed=0,
        tables=tables, cost=cost,
    )  # fmt: skip
    about, found = read_tables(tables)
    return about, {t.name: t for t in found}, {t.name: t for t in read_tables(cost)[1]}


def test_the_own_settings_make_the_features_of_the_store(store):
    shard, seen = store.read_shard(), {}

    class Reader(RecordingReader):
        def samples(self, dataset, names, window):
            seen["window"] = window
            return super().samples(dataset, names, window)

    recordings = Reader(store.paths, {"d": AUDIO})
    stored = task_data(store.merge("s1")[0], "edge_mm", "regression", "grasp_id")
    inputs = Inputs("d", "t", **EDGES, seed=0, store=shard, audio=AUDIO, recordings=recordings)
    made = features_of(inputs, stored, SETTINGS)
    assert np.array_equal(made[0][0], stored.feature)
    assert [one.shape for one, _ in made] == [(12, 129), (12, 257), (12, 65)]
    assert all(seconds > 0 for _, seconds in made)
    part = shard.feature[:, :65]  # up to 2 kHz, normalised anew: float32 sums of 129 values
    np.testing.assert_allclose(made[2][0], part / part.sum(axis=1, keepdims=True), rtol=1e-5)
    assert seen["window"] == 512


def test_each_setting_is_evaluated_as_the_task_is(store):
    _, tables, cost = stft(store)
    data = task_data(store.merge("s1")[0], "edge_mm", "regression", "grasp_id")
    alone = cross_validate(
        data.feature, data.value, data.group, kind="regression", model="ridge", folds=3, seed=0
    )
    points = tables["settings"]
    assert [tuple(row.values()) for row in points.rows] == [
        ("stft:256/128", 256, 128, None, None, 129),
        ("stft:512/512", 512, 512, None, None, 257),
        ("stft:256/128 0-2000 Hz", 256, 128, 0, 2000, 65),
    ]

    def rmse(part, model):
        rows = tables["scores"].where(part=part, model=model, metric="rmse").rows
        return [r["value"] for r in rows if r["statistic"].startswith("fold")]

    assert rmse("stft:256/128", "ridge") == list(alone.scores.per_fold["rmse"])
    # for numbers both are the same model
    assert all(rmse(p, "ridge") == rmse(p, "linear") for p in points.column("part"))
    assert rmse("stft:512/512", "ridge") != rmse("stft:256/128", "ridge")
    assert (cost["scores"].where(metric="train_s").numbers("value") > 0).all()
    assert len(cost["scores"].where(metric="train_s", model="ridge").rows) == 3
    assert stft(store)[1] == tables


def test_what_cannot_be_compared_says_why(store):
    longer = stft(store, [{"window": 4096}])[0]
    assert "cannot be used with a window of 4096" in longer["skipped"]
    about, tables, cost = stft(store, features=FEATURES.model_copy(update={"align": True}))
    assert "features.align" in about["skipped"]
    assert tables == cost == {}
