"""The examples in the docstrings of what users meet first are run as they stand."""

import doctest
import importlib

import pytest
from small_project import make

from ajgdata.paths import Paths
from ajgdata.pipeline.train import train_model
from ajgdata.store.sessions import read_dataset

MODULES = (
    "ajgdata",
    "ajgdata.evaluate.crossval",
    "ajgdata.evaluate.metrics",
    "ajgdata.evaluate.splits",
    "ajgdata.features.align",
    "ajgdata.features.spectrum",
    "ajgdata.features.transfer_function",
    "ajgdata.gripper",
    "ajgdata.gripper.scene",
    "ajgdata.acquire.excitation",
    "ajgdata.gripper.signal_chain",
    "ajgdata.gripper.simulation",
    "ajgdata.gripper.solver_plan",
    "ajgdata.loading",
    "ajgdata.models",
    "ajgdata.pipeline.publish",
    "ajgdata.store.audio",
    "ajgdata.store.features",
)


@pytest.fixture(scope="module")
def small(tmp_path_factory) -> Paths:
    """A small project with a trained model."""
    paths = Paths(tmp_path_factory.mktemp("doctests"))
    make(paths)
    train_model(
        paths.features("size"),
        **read_dataset(paths, "size").training("size"),
        model="ridge",
        seed=0,
        folder=paths.model("size", "size", "ridge"),
    )
    return paths


@pytest.mark.parametrize("name", MODULES)
def test_examples_of_docstrings_run(name, small, monkeypatch):
    monkeypatch.chdir(small.root)
    monkeypatch.delenv("AJGDATA_ROOT", raising=False)
    results = doctest.testmod(importlib.import_module(name))
    assert results.attempted > 0
    assert results.failed == 0
