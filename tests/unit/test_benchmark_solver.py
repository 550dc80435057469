"""The solver's benchmark compares like with like, and would notice if it did not."""

import importlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture(scope="module")
def bench():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(FOLDER))
        yield importlib.import_module("solver")


@pytest.fixture(scope="module")
def peers(bench):
    return importlib.import_module("solver_peers")


@pytest.fixture(scope="module", params=["wide", "second"])
def given(peers, request):
    return peers.problem(6.0, request.param)


@pytest.fixture(scope="module")
def made(peers, given):
    made, missing = peers.routes(given)
    assert len(made) + len(missing) == 3
    assert all(": " in line for line in missing)
    return made


def test_every_route_marches_the_same_waves(peers, given, made):
    off = peers.disagreement(made, 60)
    assert off["ours (numba)"] == 0
    assert max(off.values()) < 1e-5  # 60 roundings of float32 in a row would be 4e-6
    moved = made["ours (numba)"](60)
    assert np.abs(moved - given.start).max() > 0.1
    assert not moved[given.system.mass == 0].any()


def test_a_route_that_marches_something_else_is_noticed(bench, peers, given, made):
    capacities = given.system.capacities._replace(yield_=given.yield_.ravel() * np.float32(0.99))
    slower = replace(given, system=replace(given.system, capacities=capacities))
    routes = {"ours (numba)": made["ours (numba)"], "wrong": peers.ours(slower)}
    assert peers.disagreement(routes, 60)["wrong"] > 10 * bench.AGREE
