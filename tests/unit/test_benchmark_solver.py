"""The solver's benchmark compares like with like."""

import importlib
from pathlib import Path

import numpy as np
import pytest

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.mark.parametrize("scheme", ["wide", "second"])
def test_every_route_marches_the_same_waves(scheme, monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    peers = importlib.import_module("solver_peers")
    given = peers.problem(6.0, scheme)
    made, missing = peers.routes(given)
    assert len(made) + len(missing) == 3
    off = peers.disagreement(made, 60)
    assert off["ours (numba)"] == 0
    assert max(off.values()) < 1e-5  # 60 roundings of float32 in a row would be 4e-6
    moved = made["ours (numba)"](60)
    assert np.abs(moved - given.start).max() > 0.1
    assert not moved[given.system.mass == 0].any()
