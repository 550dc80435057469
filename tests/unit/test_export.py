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
    QUESTIONS,
    RATE_HZ,
    features_of,
    period_of,
    predictor_of,
    tones,
    trained,
)

from ajgdata.evaluate.novelty import Guard
from ajgdata.features.spectrum import spectrum
from ajgdata.pipeline.export_model import compare
from ajgdata.types import DataError, FeatureSettings

pytest.importorskip("onnxscript")
pytest.importorskip("onnxruntime")
from ajgdata.export.onnx_file import Deployed, OnnxModel, onnx_bytes

SOUNDS = tones()
X = features_of(SOUNDS)
LINEAR = trained("linear", "classes", X)
RIDGE = trained("ridge", "number", X)
GUARD = Guard.of(X, np.arange(32) // 2)


def in_torch(predictor, sounds=SOUNDS):
    """The outputs of the graph for each sound, as torch computes them."""
    with torch.no_grad():
        outputs = Deployed(predictor).eval()(torch.from_numpy(np.asarray(sounds, np.float32)))
    return [
        {name: value[row].numpy() for name, value in outputs.items()} for row in range(len(sounds))
    ]


def in_onnx(predictor, folder):
    path = folder / "m.onnx"
    path.write_bytes(onnx_bytes(predictor, {"classes": list(predictor.classes)}))
    return OnnxModel(path)


def assert_agrees(predictor, outputs, question="classes", features=X):
    differences = compare(predictor, features, outputs, period_of(question))
    assert not [one for one in differences if one.is_beyond]


@pytest.mark.parametrize(
    ("model", "question"),
    [
        *(("linear", question) for question in QUESTIONS),
        *(("ridge", question) for question in QUESTIONS),
        ("cnn", "classes"),
        ("cnn_one_scale", "number"),
    ],
)
def test_every_model_and_kind(model, question):
    predictor = predictor_of(trained(model, question, X), question)
    assert_agrees(predictor, in_torch(predictor), question)


@pytest.mark.parametrize(
    "settings",
    [
        {"window": 101, "hop": 7, "window_shape": "boxcar", "normalisation": "max"},
        {"band_hz": (0.0, 1000.0), "quantity": "power"},
        {"quantity": "root_power", "normalisation": "none"},
    ],
)
def test_features_of_all_settings(settings):
    declared = FeatureSettings(**({"window": 64, "hop": 32} | settings))
    ours = features_of(SOUNDS, declared)
    predictor = predictor_of(trained("ridge", "number", ours), "number", declared)
    assert_agrees(predictor, in_torch(predictor), "number", ours)


UNUSABLE = {
    "silent": np.zeros(400),
    "too quiet": 1e-31 * SOUNDS[0] / np.abs(SOUNDS[0]).max(),
    "NaN": np.where(np.arange(400) == 7, np.nan, SOUNDS[0]),
    "constant": np.full(400, 0.25),
}


def test_onnx_runtime_refuses_unusable_recordings_and_takes_any_length(tmp_path):
    predictor = predictor_of(RIDGE, "number")
    onnx = in_onnx(predictor, tmp_path)
    assert {
        reason: bool(onnx(sound)["usable"]) for reason, sound in UNUSABLE.items()
    } == dict.fromkeys(UNUSABLE, False)
    for length in (64, 95, 399):
        sound = SOUNDS[0, :length]
        ours = spectrum(sound, RATE_HZ, FEATURES)[np.newaxis]
        assert_agrees(predictor, [onnx(sound)], "number", ours)
    with pytest.raises(Exception, match="window_size <= signal_size was false"):
        onnx(SOUNDS[0, :63])


def test_onnx_runtime_and_the_package(tmp_path):
    predictor = predictor_of(trained("ridge", "angle", X), "angle", guard=GUARD)
    onnx = in_onnx(predictor, tmp_path)
    assert_agrees(predictor, [onnx(sound) for sound in SOUNDS], "angle")


@pytest.mark.parametrize("references", [0, 1])
def test_novelty_and_verdict(references):
    guard = Guard.of(X[:24], np.arange(24) // 2)
    if references:
        guard = guard.with_references(X[[30]])
    threshold = float(np.quantile(replace(guard, threshold=1.0).novelty(X), 0.75))
    predictor = predictor_of(LINEAR, guard=guard, novelty_threshold=threshold)
    outputs = in_torch(predictor)
    assert_agrees(predictor, outputs)
    assert {int(one["verdict"]) for one in outputs} == {0, 2} | ({1} if references else set())


def test_damaged_and_foreign_files(tmp_path):
    path = tmp_path / "m.onnx"
    with pytest.raises(DataError, match=r"m\.onnx: there is no such file"):
        OnnxModel(path)
    path.write_bytes(b"damaged")
    with pytest.raises(DataError, match=r"m\.onnx: not a readable ONNX file"):
        OnnxModel(path)
