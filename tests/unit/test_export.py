"""Exported models say what the package says, in ONNX Runtime and in NumPy alone."""

import io
from contextlib import suppress

import numpy as np
import pytest
from exported_models import (
    FEATURES,
    PERIOD,
    QUESTIONS,
    RATE_HZ,
    exported,
    features_of,
    targets,
    tones,
    trained,
)
from scipy.spatial.distance import cdist
from sklearn.decomposition import PCA
from sklearn.neighbors import KNeighborsClassifier
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import MinMaxScaler, Normalizer

from ajgdata.evaluate import calibration
from ajgdata.export import numpy_runtime
from ajgdata.export.comparison import difference, feature_difference
from ajgdata.export.description import feature_tolerance, in_numpy
from ajgdata.export.layers import CannotExportError
from ajgdata.export.numpy_file import numpy_bytes
from ajgdata.export.running import OnnxModel, numpy_about
from ajgdata.features import checks
from ajgdata.features.spectrum import spectrum
from ajgdata.models import make_model
from ajgdata.models.baselines import Compress
from ajgdata.types import MODELS, DataError, FeatureSettings

pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")
SOUNDS = tones()
X = features_of(SOUNDS)
#: Trained once for all tests of this file.
RIDGE = trained("ridge", "number", X)
LINEAR = trained("linear", "classes", X)


def in_onnx(made, folder):
    from ajgdata.export.onnx_graph import onnx_bytes

    path = folder / "m.onnx"
    path.write_bytes(onnx_bytes(made))
    return OnnxModel(path)


@pytest.mark.parametrize("question", QUESTIONS)
@pytest.mark.parametrize("model", list(MODELS.own))
def test_every_model_and_kind_is_what_it_was_in_python(model, question, tmp_path):
    fitted = trained(model, question, X)
    made = exported(fitted, question)
    onnx, plain = in_onnx(made, tmp_path), in_numpy(made)
    plain.check_self()
    period = PERIOD if question == "angle" else None
    for said in ([onnx(sound) for sound in SOUNDS], [plain_said(plain, s) for s in SOUNDS]):
        theirs = np.array([one["feature"] for one in said], np.float32)
        assert not feature_difference(X, theirs, FEATURES.window).is_beyond
        score = np.array([one["score"] for one in said])
        if not made.about["classes"]:
            found = difference("score", lambda x: fitted.predict(x)[:, None], theirs, score, period)
            assert not found.is_beyond, found
        elif made.about["probabilities"]:
            found = difference("score", fitted.predict_proba, theirs, score)
            assert not found.is_beyond, found
            scaled = calibration.with_temperature(fitted.predict_proba(theirs), 1.5)
            probability = [list(one["probability"].values()) for one in said]
            np.testing.assert_allclose(probability, scaled, atol=found.allowed + 1e-6)
        if made.about["classes"]:
            assert [one["value"] for one in said] == fitted.predict(theirs).tolist()
    without = model.partition("_")[0] in ("ridge", "svm")
    assert without == (not made.about["probabilities"]) or question in ("number", "angle")


@pytest.mark.parametrize("question", ["classes", "number", "angle"])
@pytest.mark.parametrize(
    ("model", "choice"),
    [
        ("knn", "asinh, per bin, PCA, k = 5"),
        ("knn", "L2, k = 5, Manhattan"),
        ("knn", "log, k = 1"),
        ("ridge", "one scale, alpha = 10"),
        ("svm", "L2, one scale, C = 10"),
    ],
)
def test_whatever_a_tuned_model_chooses_can_be_exported(model, choice, question, tmp_path):
    kind = "classification" if question == "classes" else "regression"
    period = PERIOD if question == "angle" else None
    named = dict(make_model(model, kind, 0, period).candidates)
    fitted = named[choice].fit(X, targets(question, len(X)))
    made = exported(fitted, question)
    onnx, plain = in_onnx(made, tmp_path), in_numpy(made)
    plain.check_self()
    for said in ([onnx(sound) for sound in SOUNDS], [plain_said(plain, s) for s in SOUNDS]):
        theirs = np.array([one["feature"] for one in said], np.float32)
        if question == "classes":
            assert [one["value"] for one in said] == fitted.predict(theirs).tolist()
            continue
        score = np.array([one["score"] for one in said])
        found = difference("score", lambda x: fitted.predict(x)[:, None], theirs, score, period)
        assert not found.is_beyond, found


@pytest.mark.parametrize("scaling", ["per_bin", "global", "both"])
def test_a_network_of_any_input_scaling_is_exported(scaling, tmp_path):
    made = make_model("cnn", "regression").set_params(scaling=scaling, min_steps=10, epochs=1)
    fitted = made.fit(X, targets("number", len(X)))
    file = exported(fitted, "number")
    onnx, plain = in_onnx(file, tmp_path), in_numpy(file)
    plain.check_self()
    for said in ([onnx(sound) for sound in SOUNDS], [plain_said(plain, s) for s in SOUNDS]):
        theirs = np.array([one["feature"] for one in said], np.float32)
        score = np.array([one["score"] for one in said])
        found = difference("score", lambda x: fitted.predict(x)[:, None], theirs, score)
        assert not found.is_beyond, found


def plain_said(model, sound):
    return {"feature": model.feature(sound), **model.predict(sound, RATE_HZ)}


@pytest.mark.parametrize(
    "settings",
    [
        {"window": 256, "hop": 64},
        {"window": 100, "hop": 100, "window_shape": "hamming", "normalisation": "l2"},
        {"window": 101, "hop": 7, "window_shape": "boxcar", "normalisation": "max"},
        {"quantity": "power", "normalisation": "none", "window_shape": "blackman"},
        {"band_hz": (500.0, 2100.0), "normalisation": "none"},
        {"band_hz": (0.0, 1000.0), "quantity": "power"},
        {"quantity": "root_power"},
        {"quantity": "root_power", "normalisation": "none"},
    ],
)
def test_features_of_all_settings(settings, tmp_path):
    declared = FeatureSettings(**({"window": 64, "hop": 32} | settings))
    ours = features_of(SOUNDS, declared)
    made = exported(trained("ridge", "number", ours), "number", declared)
    onnx, plain = in_onnx(made, tmp_path), in_numpy(made)
    for theirs in ([onnx(s)["feature"] for s in SOUNDS], [plain.feature(s) for s in SOUNDS]):
        found = feature_difference(ours, np.array(theirs), declared.window)
        assert not found.is_beyond, found


def test_the_tolerance_finds_another_window_shape():
    other = features_of(SOUNDS, FeatureSettings(window=64, hop=32, window_shape="hamming"))
    assert feature_difference(X, other, 64).largest > 1000 * feature_tolerance(64)


@pytest.mark.parametrize("gain", [1e-25, 1e-6, 30.0])  # 30: clipped, as a converter does
def test_amplitude_does_not_matter(gain, tmp_path):
    made = exported(RIDGE, "number")
    onnx, plain = in_onnx(made, tmp_path), in_numpy(made)
    sound = np.clip(SOUNDS[3] * np.float32(gain), -1, 1)
    ours = spectrum(sound, RATE_HZ, FEATURES)[np.newaxis]
    for theirs in (onnx(sound)["feature"], plain.feature(sound)):
        assert not feature_difference(ours, theirs[np.newaxis], 64).is_beyond
    assert onnx.outputs(sound)["usable"]


def test_any_length_from_one_window_on(tmp_path):
    made = exported(RIDGE, "number")
    onnx, plain = in_onnx(made, tmp_path), in_numpy(made)
    for length in (64, 95, 96, 399):
        sound = SOUNDS[0, :length]
        ours = spectrum(sound, RATE_HZ, FEATURES)[np.newaxis]
        for theirs in (onnx(sound)["feature"], plain.feature(sound)):
            assert not feature_difference(ours, theirs[np.newaxis], 64).is_beyond
    with pytest.raises(ValueError, match="63 samples are fewer than one window of 64"):
        plain.predict(SOUNDS[0, :63], RATE_HZ)
    with pytest.raises(Exception, match="window_size <= signal_size was false"):
        onnx(SOUNDS[0, :63])


def test_a_batch_is_the_same_as_one_by_one(tmp_path):
    made = exported(LINEAR)
    onnx = in_onnx(made, tmp_path)
    together = onnx._session.run(["probability"], {"waveform": SOUNDS})[0]
    alone = [list(onnx(sound)["probability"].values()) for sound in SOUNDS]
    np.testing.assert_allclose(together, alone, atol=1e-6)


UNUSABLE = {
    "every sample is zero": np.zeros(100),
    "too quiet: peak 1e-31": 1e-31 * SOUNDS[0] / np.abs(SOUNDS[0]).max(),
    "NaN or infinity": np.where(np.arange(400) == 7, np.nan, SOUNDS[0]),
    "hold NaN or infinity": np.where(np.arange(400) == 7, -np.inf, SOUNDS[0]),
    "every sample is 0.25": np.full(100, 0.25),
}


@pytest.mark.parametrize("reason", UNUSABLE)
def test_what_cannot_be_used_is_said(reason, tmp_path):
    made, sound = exported(LINEAR), UNUSABLE[reason].astype(np.float32)
    with pytest.raises(ValueError, match=reason):
        in_numpy(made).predict(sound, RATE_HZ)
    assert not in_onnx(made, tmp_path).outputs(sound)["usable"]


def test_another_rate_is_refused():
    with pytest.raises(ValueError, match="sampled at 44100 Hz, the model needs 8000 Hz"):
        in_numpy(exported(LINEAR)).predict(SOUNDS[0], 44_100)


def guard_of(threshold_from):
    """Grasps of two recordings, one reference; points as `evaluate.novelty` has them."""
    scale = np.float32(0.1 * X.mean())
    compressed = np.arcsinh(X / scale)
    mean, std = compressed.mean(0).astype(np.float32), compressed.std(0).astype(np.float32)
    points = (compressed - mean) / std
    grasps = points[:24].reshape(12, 2, -1).mean(1).astype(np.float32)
    guard = {"grasps": grasps, "references": points[[30]], "mean": mean, "std": std, "scale": scale}
    return guard, points, float(np.quantile(cdist(points, grasps).min(1), threshold_from))


@pytest.mark.parametrize("references", [0, 1])
def test_novelty_and_verdict(references, tmp_path):
    guard, points, threshold = guard_of(0.75)
    guard["references"] = guard["references"][:references]
    calibration = {"novelty_threshold": threshold}
    made = exported(LINEAR, guard=guard, calibration=calibration)
    expected = cdist(points, guard["grasps"]).min(1)
    nothing = cdist(points, np.array([*guard["references"], np.full(33, 1e9)])).min(1) < expected
    verdict = np.where(nothing, "nothing", np.where(expected > threshold, "unknown", "known"))
    onnx, plain = in_onnx(made, tmp_path), in_numpy(made)
    for said in ([onnx(s) for s in SOUNDS], [plain.predict(s, RATE_HZ) for s in SOUNDS]):
        novelty = [one["novelty"] for one in said]
        np.testing.assert_allclose(novelty, expected / threshold, rtol=1e-4)
        assert [one["verdict"] for one in said] == verdict.tolist()
    assert set(verdict) == {"known", "unknown"} | ({"nothing"} if references else set())


@pytest.mark.parametrize("has_guard", [True, False])
def test_without_a_threshold_or_a_guard_novelty_is_not_checked(tmp_path, has_guard):
    guard, _, _ = guard_of(0.75)
    made = exported(LINEAR, guard=guard if has_guard else None, calibration={})
    for said in (in_onnx(made, tmp_path)(SOUNDS[0]), in_numpy(made).predict(SOUNDS[0], RATE_HZ)):
        assert (said["novelty"], said["verdict"]) == (None, "not checked")


def test_without_a_threshold_an_empty_gripper_is_still_recognised(tmp_path):
    guard, _, _ = guard_of(0.75)
    made = exported(LINEAR, guard=guard, calibration={})
    for said in (in_onnx(made, tmp_path)(SOUNDS[30]), in_numpy(made).predict(SOUNDS[30], RATE_HZ)):
        assert said["verdict"] == "nothing"


def test_intervals(tmp_path):
    for half in (0.25, None):
        made = exported(RIDGE, "number", calibration={"half_width": half})
        onnx, plain = in_onnx(made, tmp_path), in_numpy(made)
        for said in (onnx(SOUNDS[1]), plain.predict(SOUNDS[1], RATE_HZ)):
            if half is None:
                assert said["interval"] is None
                continue
            assert said["value"] == pytest.approx(RIDGE.predict(X[[1]])[0], abs=1e-3)
            low, high = said["interval"]
            assert (said["value"] - low, high - said["value"]) == pytest.approx((0.25, 0.25))


def test_what_cannot_be_exported_is_named():
    with pytest.raises(CannotExportError, match="aligned features cannot be exported"):
        exported(LINEAR, features=FeatureSettings(window=64, hop=32, align=True))
    with pytest.raises(CannotExportError, match="features of kind transfer_function cannot"):
        exported(LINEAR, features=FeatureSettings(window=64, hop=32, kind="transfer_function"))
    labels = LINEAR.predict(X)
    with pytest.raises(CannotExportError, match="MinMaxScaler cannot be exported: known are AtLe"):
        exported(make_pipeline(MinMaxScaler(), KNeighborsClassifier()).fit(X, labels))
    far = make_pipeline(Compress(), KNeighborsClassifier(weights="distance")).fit(X, labels)
    with pytest.raises(CannotExportError, match="KNeighborsClassifier cannot be exported: only eq"):
        exported(far)
    with pytest.raises(CannotExportError, match="KNeighborsClassifier cannot be exported: of the"):
        exported(KNeighborsClassifier().fit(X, labels))

    class Ridge:  # of another package, with a name of scikit-learn's
        pass

    whitened = make_pipeline(PCA(2, whiten=True), KNeighborsClassifier()).fit(X, labels)
    with pytest.raises(CannotExportError, match="PCA cannot be exported: whitening"):
        exported(whitened)
    other = make_pipeline(Normalizer("max"), KNeighborsClassifier()).fit(X, labels)
    with pytest.raises(CannotExportError, match="Normalizer cannot be exported: only the 2-norm"):
        exported(other)
    spoilt = make_pipeline(Compress(), KNeighborsClassifier()).fit(X, labels)
    spoilt.steps[-1] = ("ridge", Ridge())
    with pytest.raises(CannotExportError, match="Ridge cannot be exported"):
        exported(spoilt)


def test_the_file_says_what_it_is(tmp_path):
    about = in_onnx(exported(LINEAR), tmp_path).about
    path = tmp_path / "m.npz"
    path.write_bytes(numpy_bytes(exported(LINEAR)))
    in_file = numpy_runtime.load(path).about
    assert {key: in_file[key] for key in about} == about
    assert about["classes"] == ["class 0", "class 1", "class 2", "class 3"]
    assert about["sample_rate_hz"] == RATE_HZ
    assert about["features"] == FEATURES.model_dump(mode="json")
    assert about["provenance"] == {"git_commit": "0"}
    assert about["calibration"]["temperature"] == 1.5


def test_the_same_model_is_the_same_bytes():
    from ajgdata.export.onnx_graph import onnx_bytes

    for written in (onnx_bytes, numpy_bytes):
        assert written(exported(LINEAR)) == written(exported(LINEAR))


def test_tampering_with_weights_fails_the_self_test(tmp_path):
    import onnx
    from onnx import numpy_helper

    made = exported(LINEAR)
    path = tmp_path / "m.onnx"
    in_onnx(made, tmp_path)
    model = onnx.load(path)
    weight = max(model.graph.initializer, key=lambda one: len(one.raw_data))
    changed = numpy_helper.from_array(1.1 * numpy_helper.to_array(weight), weight.name)
    weight.CopyFrom(changed)
    onnx.save(model, path)
    with pytest.raises(DataError, match=r"m\.onnx: its self-test fails: .* differs by"):
        OnnxModel(path)
    plain = in_numpy(made)
    (name,) = (name for name in plain.arrays if name.endswith("dense.weight"))
    plain.arrays[name] = 1.1 * plain.arrays[name]
    with pytest.raises(ValueError, match="its self-test fails: score differs by"):
        plain.check_self()


def test_files_that_are_none(tmp_path):
    path = tmp_path / "m.onnx"
    with pytest.raises(DataError, match="there is no such file"):
        OnnxModel(path)
    path.write_bytes(b"spoilt")
    with pytest.raises(DataError, match="not a readable ONNX file"):
        OnnxModel(path)
    import onnx
    from onnx import TensorProto, helper

    value = helper.make_tensor_value_info("x", TensorProto.FLOAT, [1])
    other = helper.make_tensor_value_info("y", TensorProto.FLOAT, [1])
    graph = helper.make_graph([helper.make_node("Abs", ["x"], ["y"])], "g", [value], [other])
    opset = [helper.make_opsetid("", 20)]
    onnx.save(helper.make_model(graph, opset_imports=opset, ir_version=10), path)
    with pytest.raises(DataError, match="was not made by `ajgdata export`"):
        OnnxModel(path)


def npz(**arrays):
    content = io.BytesIO()
    np.savez_compressed(content, **arrays)
    return content.getvalue()


def said(text):
    return np.frombuffer(text, np.uint8)


SPOILT = {
    "no zip": (b"spoilt", "BadZipFile"),
    "empty": (b"", "BadZipFile"),
    "nothing in it": (npz(), "KeyError"),
    "no object": (npz(about=said(b"[]")), "AttributeError"),
    "no JSON": (npz(about=said(b"{")), "Expecting"),
    "another format": (npz(about=said(b'{"format": 7}')), "of format 7"),
    "nothing but its format": (npz(about=said(b'{"format": 1}')), "KeyError: 'sample_rate_hz'"),
    "a pickle": (npz(about=np.array([{}], object)), "allow_pickle=False"),
    "a bomb": (npz(about=np.zeros(10_001, np.uint8)), "unpacks to 10129 bytes, more than 10000"),
}


@pytest.mark.parametrize("what", SPOILT)
def test_a_spoilt_model_is_one_line(what, tmp_path, monkeypatch, capsys):
    content, message = SPOILT[what]
    path = tmp_path / "m.npz"
    path.write_bytes(content)
    monkeypatch.setattr(numpy_runtime, "LARGEST", 10_000)
    with pytest.raises(ValueError, match=message):
        numpy_runtime.load(path)
    with pytest.raises(DataError, match=r"m\.npz: not a readable model"):
        numpy_about(path)
    assert numpy_runtime.main([str(path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_cut_off_model_is_refused_wherever_it_ends(tmp_path):
    whole, path = numpy_bytes(exported(RIDGE, "number")), tmp_path / "m.npz"
    for length in range(0, len(whole), len(whole) // 12):
        path.write_bytes(whole[:length])
        with pytest.raises(ValueError, match="BadZipFile"):
            numpy_runtime.load(path)
    for at in range(200, len(whole), len(whole) // 12):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 0xFF]) + whole[at + 1 :])
        with suppress(ValueError):  # some bytes say nothing, as times of files
            numpy_runtime.load(path)


def test_a_long_recording_is_transformed_part_by_part():
    """The same as all at once; frames of the last part are fewer."""
    frames = 5 * numpy_runtime.FRAMES + 3
    sound = tones(1, FEATURES.hop * (frames - 1) + FEATURES.window)[0]
    theirs = in_numpy(exported(RIDGE, "number")).feature(sound)
    ours = spectrum(sound, RATE_HZ, FEATURES)
    found = feature_difference(ours[np.newaxis], theirs[np.newaxis], FEATURES.window)
    assert not found.is_beyond, found


def test_the_program_shares_its_limits_with_the_package():
    assert numpy_runtime.TOO_QUIET == checks._TOO_QUIET
    assert numpy_runtime.TINIEST == calibration.TINIEST


def test_the_test_sound_is_exact():
    sound = numpy_runtime.test_sound({"samples": 4, "multiplier": 46, "modulus": 2**20})
    assert sound.tolist() == [2 * 46 * i * i / 2**20 - 1 for i in range(4)]
