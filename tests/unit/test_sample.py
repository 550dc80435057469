"""The simulated sample of the package, and the job that writes it."""

import dataclasses
import os
import subprocess
import sys
from collections import Counter

import numpy as np
import pytest

from ajgdata import tutorial
from ajgdata.pipeline.sample import write_sample
from ajgdata.store.feature_array import frequency_axis
from ajgdata.store.features import FeatureRows, read_store, text_column, write_store
from ajgdata.types import DataError

SAMPLE = tutorial.SAMPLES / "ycb.nc"


def test_the_sample_has_every_class_and_says_simulated():
    assert SAMPLE.stat().st_size <= 3e6
    with tutorial.load_features("ycb") as features:
        assert set(features.source.values) == {"virtual"}
        assert features.attrs["source"] == "simulated" and "Simulated" in features.attrs["title"]
        assert len(features.attrs["git_commit"].rstrip("+")) == 40
        grasps = Counter(zip(features.object.values, features.session_id.values, strict=True))
        assert len(set(features.object.values)) == 16
        assert set(grasps.values()) == {4}  # two grasps, each recorded twice
        np.testing.assert_allclose(features.feature.sum("frequency"), 1, atol=1e-4)  # l1
    with pytest.raises(DataError, match=r"has no sample 'size'. Use ycb"):
        tutorial.load_features("size")


def test_the_sample_needs_no_project(tmp_path):
    code = "import ajgdata; print(ajgdata.tutorial.load_features('ycb').sizes['frequency'])"
    environment = {key: text for key, text in os.environ.items() if key != "AJGDATA_ROOT"}
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=environment,
        check=True,
        capture_output=True,
        text=True,
    )
    assert done.stdout == "1025\n"
    assert not list(tmp_path.iterdir())


def test_a_sample_is_the_first_grasps_of_each_object_and_session(tmp_path):
    rows = [(s, o, g, n) for s in "ab" for o in ("x", "y") for g in range(3) for n in (1, 2)]
    columns = {
        "session_id": text_column([s for s, *_ in rows]),
        "object": text_column([o for _, o, *_ in rows]),
        "grasp_id": text_column([f"{s}/{o}_{g}" for s, o, g, _ in rows]),
        "recording": text_column([f"{s}/{o}_{g}_{n}" for s, o, g, n in rows]),
    }
    feature = np.arange(len(rows), dtype=np.float32)[:, None]
    features = FeatureRows(
        feature, (frequency_axis(np.zeros(1)),), columns, {"source": "simulated", "data_set": "d"}
    )
    write_store(tmp_path / "all.nc", features)
    write_sample(tmp_path / "all.nc", tmp_path / "part.nc", 2)
    part = read_store(tmp_path / "part.nc")
    assert part.feature[:, 0].tolist() == [i for i, row in enumerate(rows) if row[2] < 2]
    assert part.attrs["title"] == "Simulated sample of d: part of its recordings"
    write_store(tmp_path / "all.nc", dataclasses.replace(features, attrs={"source": "recorded"}))
    with pytest.raises(DataError, match="is not simulated"):
        write_sample(tmp_path / "all.nc", tmp_path / "part.nc", 2)
