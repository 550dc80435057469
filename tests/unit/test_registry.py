"""Models of other packages: found, used, and harmless when they are broken."""

import sys

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError

from ajgdata.loading import read_model
from ajgdata.models import make_model, model_label
from ajgdata.pipeline.train import train_model
from ajgdata.store.features import Column, Shard, text_column, write_store
from ajgdata.types import MODELS, DataError, ModelName, Task

MODULE = """
import numpy as np
from sklearn.base import BaseEstimator, RegressorMixin

from ajgdata.types import Model


class Median(RegressorMixin, BaseEstimator):
    def fit(self, X, y):
        self.median_ = float(np.median(y))
        return self

    def predict(self, X):
        return np.full(len(X), self.median_)


def median(kind, seed):
    return Median()


MEDIAN = Model("lab:median", "median", "median", trusted=("lab.Median",))
"""
ENTRIES = """
[ajgdata.models]
median = lab:MEDIAN
broken = lab_broken:MODEL
cnn = lab:MEDIAN
"""


@pytest.fixture
def lab(tmp_path, monkeypatch):
    """An environment in which a package `lab` is installed, of which one module is broken."""
    site = tmp_path / "site"
    info = site / "lab-1.2.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: lab\nVersion: 1.2\n")
    (info / "entry_points.txt").write_text(ENTRIES)
    (site / "lab.py").write_text(MODULE)
    (site / "lab_broken.py").write_text("import no_such_package\n")
    monkeypatch.syspath_prepend(site)
    yield site
    for module in ("lab", "lab_broken"):
        sys.modules.pop(module, None)


#: What features follow from, as each store keeps it.
SETTINGS = {"settings": '{"audio": {}, "features": {}}'}


@pytest.fixture
def store(tmp_path):
    columns = {
        "recording": text_column([f"s/{n}" for n in range(6)]),
        "grasp_id": text_column([f"s/{n}" for n in range(6)]),
        "object": text_column(["cube"] * 6),
        "edge_mm": Column(np.array([1.0, 2, 3, 7, 8, 9]), {"units": "mm"}),
    }
    feature = np.ones((6, 4), np.float32)
    write_store(tmp_path / "d.nc", Shard(feature, np.arange(4.0), columns, SETTINGS))
    return tmp_path / "d.nc"


def train(store, model):
    train_model(store, target="edge_mm", kind="regression", unit="mm", groups="grasp_id",
                model=model, seed=0, folder=store.parent / model)  # fmt: skip
    return store.parent / model


def test_a_task_may_name_a_model_of_another_package(lab):
    assert Task(target="edge_mm", models=["median", "cnn"]).models == ("median", "cnn")
    assert MODELS.origin("median") == "lab 1.2"
    assert MODELS.origin("cnn") == ""


def test_an_unknown_name_is_answered_with_the_known_ones(lab):
    with pytest.raises(ValidationError, match="unknown model 'medain': choose one of cnn, linear"):
        TypeAdapter(ModelName).validate_python("medain")


def test_a_model_of_another_package_is_trained_kept_and_labelled(lab, store):
    loaded, about = read_model(train(store, "median"))
    assert loaded.predict(np.zeros((2, 4))).tolist() == [5, 5]  # of 1, 2, 3, 7, 8, 9
    assert about["model"] == "median"
    assert model_label("median", "regression") == "median"


def test_a_broken_model_is_one_line_and_no_other_is_lost(lab, store):
    problem = "lab_broken:MODEL cannot be imported .*'no_such_package'.*: mend or remove it"
    with pytest.raises(ValueError, match=problem):
        make_model("broken", "regression")
    with pytest.raises(DataError, match=f"was not trained: .*{problem}"):
        read_model(train(store, "broken"))
    assert make_model("median", "regression").fit(np.zeros((1, 1)), [4.0]).median_ == 4
    assert model_label("broken", "regression") == "broken"
