"""Settings of the STFT: the recordings and folds of the task, features made anew."""

import json

import numpy as np
import pytest
from pydantic import ValidationError
from worlds import AUDIO, FEATURES

from ajgdata.evaluate.crossval import cross_validate
from ajgdata.evaluate.task_data import task_data
from ajgdata.pipeline.stft import features_of, stft_task
from ajgdata.types import DatasetSpec

SETTINGS = [
    FEATURES,
    FEATURES.model_copy(update={"window": 512, "hop": 512}),
    FEATURES.model_copy(update={"band_hz": (0.0, 2000.0)}),
]
TASK = {
    "target": "edge_mm", "kind": "regression", "unit": "mm", "groups": "grasp_id", "folds": 3,
    "period_deg": None, "withhold": [],
}  # fmt: skip


@pytest.fixture
def store(project):
    project.session(tones={f"t{n}": 400.0 + 100 * n for n in range(12)})
    project.shard()
    project.merge("s1")
    return project


def run(project, **changes):
    output, cost = project.root / "stft.json", project.root / "cost.json"
    ask = {"settings": SETTINGS, "models": ["ridge", "linear"], "audio": AUDIO, "seed": 0} | changes
    stft_task(
        project.paths.features("d"), root=project.root,
        manifests=[project.paths.audio_manifest("d", "s1")],
        **TASK, **ask, output=output, cost=cost,
    )  # fmt: skip
    return json.loads(output.read_text()), json.loads(cost.read_text())


def test_the_own_settings_make_the_features_of_the_store(store):
    shard = store.read_shard()
    stored = task_data(store.merge("s1")[0], "edge_mm", "regression", "grasp_id")
    made = features_of(stored, store.root, [store.paths.audio_manifest("d", "s1")], AUDIO, SETTINGS)
    assert np.array_equal(made[0][0], stored.feature)
    assert [one.shape for one, _ in made] == [(12, 129), (12, 257), (12, 65)]
    assert all(seconds > 0 for _, seconds in made)
    part = shard.feature[:, :65]  # up to 2 kHz, normalised anew: float32 sums of 129 values
    np.testing.assert_allclose(made[2][0], part / part.sum(axis=1, keepdims=True), rtol=1e-5)


def test_each_setting_is_evaluated_as_the_task_is(store):
    document, cost = run(store)
    rows = task_data(store.merge("s1")[0], "edge_mm", "regression", "grasp_id")
    alone = cross_validate(
        rows.feature, rows.value, rows.group, kind="regression", model="ridge", folds=3, seed=0
    )
    points = document["points"]
    assert [(p["window"], p["hop"], p["band_hz"], p["bins"]) for p in points] == [
        (256, 128, None, 129),
        (512, 512, None, 257),
        (256, 128, [0, 2000], 65),
    ]
    assert points[0]["models"]["ridge"]["per_fold"]["rmse"] == list(alone.scores.per_fold["rmse"])
    # for numbers both are the same model
    assert all(p["models"]["ridge"] == p["models"]["linear"] for p in points)
    assert points[1]["models"] != points[0]["models"]
    assert all(one["models"]["ridge"]["train_s"] > 0 for one in cost)
    assert len(cost) == 3
    assert run(store)[0] == document


def test_what_cannot_be_compared_says_why(store):
    longer = FEATURES.model_copy(update={"window": 4096})
    assert "cannot be used with a window of 4096" in run(store, settings=[longer])[0]["skipped"]
    aligned = FEATURES.model_copy(update={"align": True})
    document, cost = run(store, settings=[aligned])
    assert "features.align" in document["skipped"]
    assert cost == []


def test_settings_are_declared_as_what_differs():
    content = {
        "name": "d",
        "features": {"window": 1024, "hop": 256},
        "targets": {"x": {"kind": "classification"}},
        "tasks": {"t": {"target": "x", "stft": {"settings": [{"hop": 64}, {"window": 512}]}}},
    }
    variants = DatasetSpec.model_validate(content).feature_variants("t")
    assert [(one.window, one.hop) for one in variants] == [(1024, 256), (1024, 64), (512, 256)]
    content["tasks"]["t"]["stft"] = {"settings": [{"window": 128}]}
    with pytest.raises(ValidationError, match="hop 256 exceeds window 128"):
        DatasetSpec.model_validate(content)
