"""The variants of the kernel that are compared march the same scene."""

import importlib
import os
import sys
from pathlib import Path

import numpy as np
import pytest

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture(scope="module")
def bench():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(FOLDER))
        patch.setattr(os, "environ", dict(os.environ))  # the scripts set their threads in it
        known = set(sys.modules)
        yield importlib.import_module("kernel")
        for name in {"kernel", "solver"} & (set(sys.modules) - known):
            del sys.modules[name]


def test_variants_without_rounding_march_the_same_to_the_last_bit(bench):
    system = bench.system_of(6.0, "float32")
    live = system.mass.ravel() > 0
    start = (np.random.default_rng(1).uniform(-1, 1, live.size) * live).astype(np.float32)
    made = {name: make(system, start) for name, make in bench.VARIANTS.items()}
    today = made["today"](30).copy()
    assert np.abs(today - start).max() > 0.1
    for name in ("the same loops, with drag in the air, too", "these, in half slabs"):
        assert made[name](30).tobytes() == today.tobytes()
    rounded = made["these, reach as one byte"](30)
    error = np.linalg.norm(rounded - today) / np.linalg.norm(today)
    # Half a 255th of reach, which is a tenth of the pressure, in a fraction of the faces.
    assert 0 < error < 2e-3
