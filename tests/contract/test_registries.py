"""What every registered model must do, by contract."""

import numpy as np
import pytest
from sklearn.base import clone, is_classifier, is_regressor

from ajgdata.experiments.built_in import BUILT_IN
from ajgdata.experiments.registry import load_experiment
from ajgdata.loading import read_model
from ajgdata.models import fit_model, make_model
from ajgdata.pipeline.train import train_model
from ajgdata.store.feature_array import frequency_axis
from ajgdata.store.features import FeatureRows, read_store, text_column, write_store
from ajgdata.types import (
    MODELS,
    Recipe,
    TrainingSettings,
)
from ajgdata.types.registry import COVARIATES_ALONE

#: The model of covariates has no feature; tests/unit/test_model_inputs.py tests it.
NAMES = [name for name in MODELS if name != COVARIATES_ALONE]
TARGETS = {"edge_mm": "regression", "shape": "classification"}
RECIPE = Recipe(
    grasps_per_object=1,
    scene={"numerics": {"dx_mm": 6, "max_time_s": 0.006}},
    objects=[{"name": "cube", "shape": {"kind": "cube", "edge_mm": 20}}],
)

#: What features follow from, as each store keeps it.
SETTINGS = {"settings": '{"audio": {}, "features": {}}'}


def features() -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """24 spectra that grow with the edge, and both targets."""
    edge = np.repeat(np.arange(8.0), 3)
    noise = np.random.default_rng(0).uniform(0.9, 1.1, (24, 64))
    x = (noise * (1 + edge[:, np.newaxis] / 4)).astype(np.float32)
    return x, {"edge_mm": edge, "shape": np.where(edge < 4, "cube", "ball")}


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("name", NAMES)
def test_a_model_predicts_what_it_was_given_and_repeats_itself(name, target):
    kind = TARGETS[target]
    (x, y) = features()
    model = make_model(name, kind, seed=3)
    assert (is_classifier if kind == "classification" else is_regressor)(model)
    before = x.copy()
    first, second = (clone(model).fit(x, y[target]).predict(x) for _ in "ab")
    assert np.array_equal(x, before)
    assert np.array_equal(first, second)
    if kind == "classification":
        assert set(first) <= {"cube", "ball"}
    else:
        assert np.isfinite(first).all()


@pytest.mark.parametrize("name", NAMES)
def test_a_model_comes_back_from_disk_as_it_was(name, tmp_path, monkeypatch):
    monkeypatch.setattr("ajgdata.evaluate.in_use.CALIBRATION_FOLDS", 2)
    (x, y) = features()
    store = tmp_path / "d.nc"
    grasp = [f"s/{n}" for n in range(24)]
    columns = {
        "recording": text_column(grasp),
        "grasp_id": text_column(grasp),
        "object": text_column(["thing"] * 24),
        "shape": text_column(y["shape"]),
    }
    write_store(store, FeatureRows(x, (frequency_axis(np.arange(64.0)),), columns, SETTINGS))
    settings = TrainingSettings(target="shape", kind="classification", unit="", groups="grasp_id")
    train_model(read_store(store), settings, model=name, seed=3, folder=tmp_path / "model")
    loaded, about = read_model(tmp_path / "model")
    fitted = fit_model(make_model(name, "classification", 3), x, y["shape"], np.array(grasp))
    assert np.array_equal(loaded.predict(x), fitted.predict(x))
    assert (about["model"], about["recordings"]) == (name, 24)


@pytest.mark.parametrize("name", BUILT_IN)
def test_the_module_of_an_experiment_measures_what_the_list_specifies(name):
    experiment = load_experiment(name)
    assert experiment.spec is BUILT_IN[name]
    function = experiment.measure
    assert (function.__module__, function.__name__) == (f"ajgdata.experiments.{name}", "measure")
