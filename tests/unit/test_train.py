"""A trained model comes back from disk as it was, and nothing else does."""

import json

import numpy as np
import pytest
from worlds import AUDIO, FEATURES

from ajgdata.loading import read_model
from ajgdata.models import fit_model, make_model, search_result
from ajgdata.paths import Paths
from ajgdata.pipeline.train import train_final_model, train_model
from ajgdata.store.feature_array import frequency_axis
from ajgdata.store.features import FeatureColumn, FeatureRows, read_store, text_column, write_store
from ajgdata.store.models import read_guard
from ajgdata.types import DataError, NotPossibleError, TrainingSettings

TASKS = {"edge_mm": "regression", "kind": "classification"}


@pytest.fixture(autouse=True)
def few_folds(monkeypatch):
    """Calibrate on two folds: each trains the CNN once more."""
    monkeypatch.setattr("ajgdata.evaluate.in_use.CALIBRATION_FOLDS", 2)


@pytest.fixture
def uncalibrated(monkeypatch):
    """Leave calibration out: no folds can be made."""

    def refuse(*_):
        raise NotPossibleError("no folds")

    monkeypatch.setattr("ajgdata.evaluate.in_use.grouped_folds", refuse)


@pytest.fixture
def store(tmp_path):
    """24 recordings whose spectrum grows with the edge; one has no label."""
    generator = np.random.default_rng(0)
    edge = np.repeat(np.arange(8.0), 3)
    feature = generator.uniform(0.9, 1.1, (24, 64)) * (1 + edge[:, np.newaxis] / 4)
    edge[-1] = np.nan
    kinds = ["" if np.isnan(e) else ("even", "odd")[int(e) % 2] for e in edge]
    path = tmp_path / "d.nc"
    columns = {
        "recording": text_column([f"s/{n:02d}" for n in range(24)]),
        "grasp_id": text_column([f"s/{n}" for n in range(24)]),
        "edge_mm": FeatureColumn(edge, {"units": "mm"}),
        "kind": text_column(kinds),
        "object": text_column(["cube"] * 24),
    }
    settings = {"audio": {"sample_rate_hz": 8000}, "features": {"window": 126, "hop": 32}}
    attrs = {"data_set": "d", "settings": json.dumps(settings)}
    shard = FeatureRows(
        feature.astype(np.float32), (frequency_axis(np.arange(64.0)),), columns, attrs
    )
    write_store(path, shard)
    return path


def train(store, target, model, name="m"):
    folder = store.parent / name
    train_model(read_store(store), settings_of(target), model=model, seed=3, folder=folder)
    return folder


def settings_of(target, **changes) -> TrainingSettings:
    return TrainingSettings(
        target=target, kind=TASKS[target], unit="", groups="grasp_id", **changes
    )


@pytest.mark.usefixtures("uncalibrated")
def test_a_model_of_a_repeating_target_comes_back_whole(store):
    folder = store.parent / "m"
    settings = settings_of("edge_mm", period_deg=8.0)
    train_model(read_store(store), settings, model="knn", seed=3, folder=folder)
    loaded, about = read_model(folder)
    shard = read_store(store)
    known = slice(0, 23)
    x, y, grasp = (
        c[known]
        for c in (shard.feature, shard.columns["edge_mm"].values, shard.columns["grasp_id"].values)
    )
    fitted = fit_model(make_model("knn", "regression", 3, 8.0), x, y, grasp)
    assert about.get("tuning") == search_result(fitted)[1]
    assert type(loaded) is type(search_result(fitted)[0])
    np.testing.assert_array_equal(loaded.predict(shard.feature), fitted.predict(shard.feature))
    assert about["period"] == 8
    assert about["recordings"] == 23
    assert about["frequency_hz"] == list(range(64))
    assert about["calibration"]["problems"] == {
        "half_width": "no folds",
        "detection_rate": "one object only: none is left to hold out",
    }
    assert about["calibration"]["coverage"] is None


def test_foreign_types_are_refused(store, monkeypatch):
    folder = train(store, "kind", "linear")
    monkeypatch.setattr("ajgdata.loading.TRUSTED_TYPES", ())
    with pytest.raises(DataError, match="Untrusted types"):
        read_model(folder)


def test_a_model_of_some_classes_knows_no_others(store):
    shard = read_store(store)
    kinds = np.repeat(["a", "b", "c", "c"], 6)
    columns = {**shard.columns, "kind": text_column(kinds)}
    write_store(store, FeatureRows(shard.feature, shard.axes, columns, shard.attrs))
    for name, classes in (("all", ()), ("two", ("c", "a"))):
        settings = settings_of("kind", classes=classes)
        train_model(read_store(store), settings, model="linear", seed=0, folder=store.parent / name)
    every, facts = read_model(store.parent / "all")
    assert (every.classes_.tolist(), facts["recordings"]) == (["a", "b", "c"], 24)
    two, facts = read_model(store.parent / "two")
    assert two.classes_.tolist() == facts["classes"] == ["a", "c"]
    assert facts["recordings"] == 18
    x, y, grasp = (
        c[kinds != "b"] for c in (shard.feature, kinds, shard.columns["grasp_id"].values)
    )
    fitted = fit_model(make_model("linear", "classification"), x, y, grasp)
    np.testing.assert_array_equal(
        two.predict_proba(shard.feature), fitted.predict_proba(shard.feature)
    )
    settings = settings_of("kind", classes=("a", "d"))
    train_model(read_store(store), settings, model="linear", seed=0, folder=store.parent / "none")
    with pytest.raises(DataError, match="classes: no recording has the kind 'd'"):
        read_model(store.parent / "none")


@pytest.mark.usefixtures("uncalibrated")
def test_a_model_with_equal_settings_is_copied_with_the_name_of_its_own_task(store, monkeypatch):
    settings = settings_of("edge_mm")
    folders = {task: store.parent / task for task in ("a", "b")}
    options = {
        "settings": settings,
        "model": "linear_plain",
        "seed": 3,
        "dataset": "d",
        "audio": AUDIO,
        "features": FEATURES,
        "paths": Paths(store.parent),
    }
    train_final_model(store, [], task="a", folder=folders["a"], **options)
    monkeypatch.delattr("ajgdata.pipeline.train.train_model")
    train_final_model(store, [folders["a"]], task="b", folder=folders["b"], **options)
    (first, about), (copy, about_copy) = (read_model(folder) for folder in folders.values())
    assert about_copy == {**about, "task": "b"}
    rows = read_store(store).feature
    assert np.array_equal(first.predict(rows), copy.predict(rows))


@pytest.mark.usefixtures("uncalibrated")
@pytest.mark.parametrize("target", ["edge_mm", "kind"])
def test_references_are_recordings_without_object_and_without_label(store, target):
    """Of four recordings, one each has an object and a label, only one of the two, and neither."""
    whole = read_store(store)
    objects = whole.columns["object"].values
    labels = whole.columns[target].values
    objects[[2, 23]] = ""  # 2 has a label; 23 has none: the empty gripper
    labels[22] = np.nan if target == "edge_mm" else ""  # its object is known
    columns = {**whole.columns, "object": text_column(objects), target: FeatureColumn(labels)}
    write_store(store, FeatureRows(whole.feature, whole.axes, columns, whole.attrs))
    guard = read_guard(train(store, target, "knn"))
    assert guard["references"].shape == (1, 64)
    compressed = np.arcsinh(whole.feature[23].astype(float) / guard["scale"])
    expected = (compressed - guard["mean"]) / guard["std"]
    np.testing.assert_allclose(guard["references"][0], expected, rtol=1e-5, atol=1e-6)


@pytest.mark.usefixtures("uncalibrated")
def test_a_balanced_model_is_trained_on_equally_many_recordings_of_each_class(store, tmp_path):
    """11 of 23 recordings are odd and 12 even, in folders with and without balance."""
    table = read_store(store)
    kinds = table.columns["kind"].values
    counts = {name: int((kinds == name).sum()) for name in ("even", "odd")}
    assert counts == {"even": 12, "odd": 11}
    settings = {"target": "kind", "kind": "classification", "unit": "", "groups": "grasp_id"}
    for is_balanced in (False, True):
        folder = tmp_path / str(is_balanced)
        folder.mkdir()
        training = TrainingSettings(**settings, balance=is_balanced)
        train_model(table, training, model="knn_plain", seed=0, folder=folder)
        about = json.loads((folder / "model.json").read_text())
        assert about["recordings"] == (22 if is_balanced else 23)
        assert ("balance" in about) == is_balanced
