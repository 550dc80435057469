"""The examples in the docstrings of what users meet first are run as they stand."""

import doctest
import importlib

import pytest
from small_project import make_of_tones

from ajgdata.paths import Paths

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
def project_of_tones(tmp_path_factory) -> Paths:
    paths = Paths(tmp_path_factory.mktemp("doctests"))
    make_of_tones(paths)
    return paths


@pytest.mark.parametrize("name", MODULES)
def test_examples_of_docstrings_run(name, project_of_tones, monkeypatch):
    monkeypatch.chdir(project_of_tones.root)
    monkeypatch.delenv("AJGDATA_ROOT", raising=False)
    results = doctest.testmod(importlib.import_module(name))
    assert results.attempted > 0
    assert results.failed == 0
