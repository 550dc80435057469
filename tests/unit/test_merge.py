"""Shards and labels become one store; what is left out is listed with the reason."""

import json

import numpy as np
import pytest

import ajgdata
from ajgdata.store.sessions import read_recordings
from ajgdata.types import Target

EDGE = Target(kind="regression", unit="mm", description="edge length")


@pytest.fixture
def two(project):
    project.session("s1")
    project.session("s2", {"a": 610.0, "d": 1210.0})
    project.shard("s1")
    project.shard("s2")
    return project


def test_values_and_names(two):
    store, quarantine = two.merge("s1", "s2", targets={"edge_mm": EDGE})
    columns = {name: c.values.tolist() for name, c in store.columns.items()}
    assert quarantine == []
    assert columns["recording"] == ["s1/a", "s1/b", "s1/c", "s2/a", "s2/d"]
    assert columns["grasp_id"] == ["s1/g_a", "s1/g_b", "s1/g_c", "s2/g_a", "s2/g_d"]
    assert columns["session_id"] == ["s1"] * 3 + ["s2"] * 2
    assert columns["sample"] == [0, 1, 2, 0, 1]
    assert columns["edge_mm"] == [500, 750, 1000, 610, 1210]
    assert store.columns["edge_mm"].attrs == {
        "units": "mm", "long_name": "edge length", "role": "target"
    }  # fmt: skip
    shards = [two.read_shard("s1").feature, two.read_shard("s2").feature]
    np.testing.assert_array_equal(store.feature, np.concatenate(shards))
    assert store.attrs["source"] == "recorded"
    assert store.attrs["data_set"] == "d"
    assert json.loads(store.attrs["settings"])["features"]["window"] == 256
    with ajgdata.load_features("d", two.root) as features:
        chosen = features.sel(recording="s2/d")
        assert float(chosen["edge_mm"]) == 1210
        np.testing.assert_array_equal(chosen["feature"], shards[1][1])


def test_a_column_that_one_session_lacks(two):
    rows = [
        r.model_copy(update={"labels": {"hardness": "3", "note": "ü", "kind": "?"}})
        for r in read_recordings(two.folder("s2"))[0]
    ]
    two.write(rows, "s2")
    kind = Target(kind="classification", missing=("?",))
    targets = {"edge_mm": EDGE, "hardness": Target(kind="regression"), "kind": kind}
    store, found = two.merge("s1", "s2", targets=targets)
    assert found == []
    np.testing.assert_array_equal(store.columns["edge_mm"].values, [500, 750, 1000] + [np.nan] * 2)
    np.testing.assert_array_equal(store.columns["hardness"].values, [np.nan] * 3 + [3, 3])
    assert store.columns["note"].values.tolist() == ["", "", "", "ü", "ü"]
    assert store.columns["kind"].values.tolist() == [""] * 5


def test_nothing_usable_at_all(project):
    project.session()
    (project.folder() / "session.yaml").unlink()
    project.shard()
    store, found = project.merge("s1")
    assert store.feature.shape == (0, 129)
    assert [f.code for f in found] == ["bad_session"]
    with ajgdata.load_features("d", project.root) as features:
        assert features.sizes == {"recording": 0, "frequency": 129}
