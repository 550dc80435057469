"""The solver's benchmark compares like with like, and would notice if it did not."""

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

PATH = Path(__file__).resolve().parents[2] / "benchmarks/solver.py"


@pytest.fixture(scope="module")
def bench():
    spec = importlib.util.spec_from_file_location("benchmark_solver", PATH)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look there
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def given(bench):
    return bench.problem(6.0)


@pytest.fixture(scope="module")
def made(bench, given):
    made, missing = bench.routes(given)
    assert len(made) + len(missing) == 6
    assert all(": " in line for line in missing)
    return made


def test_every_route_marches_the_same_waves(bench, given, made):
    off = bench.disagreement(made, 60)
    assert off["ours (numba)"] == 0
    assert max(off.values()) < 1e-5  # 60 roundings of float32 in a row would be 4e-6
    moved = made["ours (numba)"](60)
    assert np.abs(moved - given.start).max() > 0.1
    assert not moved[given.system.mass == 0].any()


def test_a_route_that_marches_something_else_is_noticed(bench, given, made):
    slower = replace(given, yield_=given.yield_ * np.float32(0.99))
    routes = {"ours (numba)": made["ours (numba)"], "wrong": bench.by_numpy(slower)}
    assert bench.disagreement(routes, 60)["wrong"] > 10 * bench.AGREE


def test_the_bound_moves_as_many_numbers_as_it_says(bench):
    arrays = [np.full(5, value, np.float32) for value in (1, 2, 3, 4, 5, 6, 7, 8)]
    bench.stream(*arrays, 1)
    np.testing.assert_array_equal(arrays[1], 2 - 5 * 1)
    np.testing.assert_array_equal(arrays[0], 1 - 8 * ((2 - 5) + (3 - 6) + (4 - 7)))
