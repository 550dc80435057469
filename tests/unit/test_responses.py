"""Each scene is solved once."""

from dataclasses import replace

import numpy as np
import pytest

from ajgdata.gripper import ImpulseResponse, Scene
from ajgdata.store import responses
from ajgdata.store.responses import ResponseStore, read_response

#: The coarsest grid, and a few milliseconds of sound.
QUICK = {"dx_mm": 6, "max_time_s": 0.004}


def scene(seed=0, **changes):
    content = {"object": {"kind": "cube", "edge_mm": 20}, "numerics": QUICK, **changes}
    return Scene.model_validate({"grasp": {"seed": seed}, **content})


def made_up(seed, count=300):
    samples = np.random.default_rng(seed).standard_normal(count)
    outside = np.sqrt(np.arange(seed % 3, 9.0)) if seed % 2 else None
    about = {"note": "é", "list": [1, 2.5]}
    return ImpulseResponse(samples, 1 / 3, 44_100, 17, about, outside)


def same(first, second):
    assert first.samples.tobytes() == second.samples.tobytes()
    assert (first.outside is None) == (second.outside is None)
    if first.outside is not None:
        assert first.outside.tobytes() == second.outside.tobytes()
    assert replace(first, samples=0, outside=0) == replace(second, samples=0, outside=0)


@pytest.fixture
def store(tmp_path):
    return ResponseStore(tmp_path / "responses")


def test_a_scene_is_solved_once_for_one_code_and_comes_back_the_same(store, solved, monkeypatch):
    first = store.solve(scene())
    same(store.solve(scene()), first)
    same(ResponseStore(store.folder).solve(scene()), first)
    assert len(solved) == 1
    store.solve(scene(seed=1))
    assert len(solved) == 2
    monkeypatch.setattr(responses, "code_hash", lambda *parts: f"other {parts}")
    ResponseStore(store.folder).solve(scene())
    assert len(solved) == 3


def test_a_response_without_outside_comes_back_the_same(store):
    for seed in (0, 1):
        store.write(scene(seed), made_up(seed))
        same(read_response(store.path(scene(seed))), made_up(seed))


@pytest.mark.parametrize("length", [0, 100, -1])
def test_a_truncated_file_is_solved_again(tmp_path, solved, length):
    store = ResponseStore(tmp_path)
    store.write(scene(), made_up(1))
    path = store.path(scene())
    path.write_bytes(path.read_bytes()[:length])
    assert read_response(path) is None
    store.solve(scene())
    assert len(solved) == 1
