"""The examples in the docstrings of what users meet first are run as they stand."""

import doctest
import importlib

import pytest

MODULES = (
    "ajgdata.gripper",
    "ajgdata.gripper.equivalence",
    "ajgdata.gripper.scene",
    "ajgdata.gripper.signal_chain",
    "ajgdata.gripper.simulation",
    "ajgdata.gripper.solver_plan",
)


@pytest.mark.parametrize("name", MODULES)
def test_examples_of_docstrings_run(name):
    results = doctest.testmod(importlib.import_module(name))
    assert results.attempted > 0
    assert results.failed == 0
