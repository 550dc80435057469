"""Exported models predict what the package predicts.

torch computes the graph of every model and setting; ONNX Runtime computes those of some, because
an export takes seconds.
"""

from dataclasses import replace

import numpy as np
import pytest
import torch
from exported_models import (
    FEATURES,
    RATE_HZ,
    assert_agrees,
    features_of,
    onnx_outputs,
    predictor_of,
    tones,
    trained,
)

from ajgdata.evaluate.novelty import RELATIVE, NoveltyGuard
from ajgdata.features.spectrum import spectrum
from ajgdata.types import FeatureSettings, NotPossibleError

pytest.importorskip("onnxscript")
pytest.importorskip("onnxruntime")
from ajgdata.export import Deployed, onnx_bytes

SOUNDS = tones()
X = features_of(SOUNDS)
CLASSES = trained("cnn", "classes", X)
NUMBER = trained("cnn", "number", X)
GUARD = NoveltyGuard.from_grasps(X, np.arange(32) // 2)


def in_torch(predictor, sounds=SOUNDS):
    """The outputs of the graph for each sound, as torch computes them."""
    with torch.no_grad():
        outputs = Deployed(predictor).eval()(torch.from_numpy(np.asarray(sounds, np.float32)))
    return [
        {name: value[row].numpy() for name, value in outputs.items()} for row in range(len(sounds))
    ]


def in_onnx(predictor, folder, sounds):
    path = folder / "m.onnx"
    path.write_bytes(onnx_bytes(predictor, {"classes": list(predictor.classes)}))
    return list(onnx_outputs(path, sounds))


@pytest.mark.parametrize(
    ("model", "question"),
    [("cnn", "classes"), ("cnn", "two_classes"), ("cnn_per_bin", "number"), ("cnn", "angle")],
)
def test_networks_of_every_kind(model, question):
    predictor = predictor_of(trained(model, question, X), question)
    assert_agrees(predictor, in_torch(predictor), X)


def test_other_models_cannot_be_exported():
    for question in ("classes", "angle"):
        with pytest.raises(NotPossibleError, match="only the CNN can"):
            Deployed(predictor_of(trained("ridge", question, X), question))


#: Settings of features that differ from the default.
SETTINGS = [
    {"window": 101, "hop": 7, "window_shape": "boxcar", "normalisation": "max"},
    {"band_hz": (0.0, 1000.0), "quantity": "power"},
    {"quantity": "root_power", "normalisation": "none"},
]


def test_every_setting_of_a_feature_is_exported():
    only_value = {"kind"}
    assert {key for case in SETTINGS for key in case} == {
        *FeatureSettings.model_fields
    } - only_value


@pytest.mark.parametrize("settings", SETTINGS)
def test_features_of_all_settings(settings):
    declared = FeatureSettings(**({"window": 64, "hop": 32} | settings))
    ours = features_of(SOUNDS, declared)
    predictor = predictor_of(trained("cnn", "number", ours), "number", declared)
    assert_agrees(predictor, in_torch(predictor), ours)


UNUSABLE = {
    "silent": np.zeros(400),
    "too quiet": 1e-31 * SOUNDS[0] / np.abs(SOUNDS[0]).max(),
    "NaN": np.where(np.arange(400) == 7, np.nan, SOUNDS[0]),
    "constant": np.full(400, 0.25),
}


def test_onnx_runtime_refuses_unusable_recordings_and_takes_any_length(tmp_path):
    predictor = predictor_of(NUMBER, "number")
    outputs = in_onnx(predictor, tmp_path, UNUSABLE.values())
    assert [bool(output["usable"]) for output in outputs] == [False] * len(UNUSABLE)
    for length in (64, 95, 399):
        sound = SOUNDS[0, :length]
        ours = spectrum(sound, RATE_HZ, FEATURES)[np.newaxis]
        assert_agrees(predictor, list(onnx_outputs(tmp_path / "m.onnx", [sound])), ours)
    with pytest.raises(Exception, match="window_size <= signal_size was false"):
        list(onnx_outputs(tmp_path / "m.onnx", [SOUNDS[0, :63]]))


def test_onnx_runtime_and_the_package(tmp_path):
    predictor = predictor_of(trained("cnn", "angle", X), "angle", guard=GUARD)
    assert_agrees(predictor, in_onnx(predictor, tmp_path, SOUNDS), X)


@pytest.mark.parametrize("references", [0, 1])
@pytest.mark.parametrize("rate", [0.4, 0.9])
def test_novelty_and_verdict(references, rate):
    guard = NoveltyGuard.from_grasps(X[:24], np.arange(24) // 2)
    if references:
        guard = guard.with_references(X[[30]])
    threshold = float(np.quantile(replace(guard, threshold=1.0).novelty(X), 0.75))
    limits = {"novelty_threshold": threshold, "detection_rate": rate}
    predictor = predictor_of(CLASSES, guard=guard, **limits)
    outputs = in_torch(predictor)
    assert_agrees(predictor, outputs, X)
    clear = 0 if rate >= 0.5 else 4
    expected = {clear, 2} | ({1} if references else set())
    assert {int(output["verdict"]) for output in outputs} == expected


def test_the_relative_distance_is_exported():
    guard = NoveltyGuard.from_grasps(X[:24], np.arange(24) // 2, np.repeat(np.arange(3), 8))
    assert guard.has_objects
    relative = float(np.quantile(guard.scores(X)[RELATIVE], 0.5))
    limits = {"novelty_threshold": 1e6, "relative_threshold": relative}
    outputs = in_torch(predictor_of(CLASSES, guard=guard, **limits))
    assert_agrees(predictor_of(CLASSES, guard=guard, **limits), outputs, X)
    flagged = np.mean([float(output["novelty"]) > 1 for output in outputs])
    assert flagged == pytest.approx(0.5, abs=0.05)  # the nearest distance flags nothing
