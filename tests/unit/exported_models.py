"""Small trained models, and tones to train and to try them on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ajgdata.evaluate.in_use import Calibration
from ajgdata.evaluate.novelty import NoveltyGuard
from ajgdata.features.spectrum import spectrum
from ajgdata.live.predictor import Predictor
from ajgdata.models import make_model
from ajgdata.types import AudioSettings, FeatureSettings

RATE_HZ = 8_000
AUDIO = AudioSettings(sample_rate_hz=RATE_HZ)
FEATURES = FeatureSettings(window=64, hop=32)
PERIOD = 4.0
#: Fewer steps than in use: what is exported has the same parts.
SMALLER = {"cnn": {"min_steps": 10, "epochs": 1}}


def tones(count: int = 32, samples: int = 400, seed: int = 0) -> np.ndarray:
    """Recordings (count, samples) of four pitches in turn, under noise."""
    generator = np.random.default_rng(seed)
    pitch = 600 + 800 * (np.arange(count) % 4) + 50 * generator.standard_normal(count)
    sound = 0.5 * np.sin(2 * np.pi * pitch[:, np.newaxis] * np.arange(samples) / RATE_HZ)
    return (sound + 0.02 * generator.standard_normal(sound.shape)).astype(np.float32)


def targets(question: str, count: int) -> np.ndarray:
    """What is asked of the tones."""
    number = np.arange(count) % 4
    if question in ("number", "angle"):
        return number + 0.1 * np.sin(np.arange(count))
    return np.array([f"class {n}" for n in number // (2 if question == "two_classes" else 1)])


def kind_of(question: str) -> str:
    return "regression" if question in ("number", "angle") else "classification"


def period_of(question: str) -> float | None:
    return PERIOD if question == "angle" else None


def trained(model: str, question: str, features: np.ndarray):
    """A fitted estimator."""
    estimator = make_model(model, kind_of(question), 0, period_of(question))
    smaller = SMALLER.get(model, {})
    for name in estimator.get_params():
        last = name.rpartition("__")[2]
        if last in smaller:
            estimator.set_params(**{name: smaller[last]})
    return estimator.fit(features, targets(question, len(features)))


def predictor_of(
    estimator,
    question: str = "classes",
    features: FeatureSettings = FEATURES,
    guard: NoveltyGuard | None = None,
    **calibration,
) -> Predictor:
    """An estimator in use."""
    number = kind_of(question) == "regression"
    given = {
        "folds": 5,
        "groups": 16,
        "temperature": 1.5 if hasattr(estimator, "predict_proba") else None,
        "coverage": 0.9,
        "half_width": 0.25 if number else None,
        "novelty_threshold": None,
        "false_alarm": None,
        "false_alarm_stated": 0.01,
        "problems": {},
    }
    calibrated = Calibration(**(given | calibration))
    predictor = Predictor(
        estimator=estimator,
        dataset="d",
        task="t",
        model="m",
        kind=kind_of(question),
        unit="mm" if number else "",
        classes=() if number else tuple(estimator.classes_),
        audio=AUDIO,
        features=features,
        calibration=calibrated,
        guard=NoveltyGuard.absent(1),
    )
    guard = guard or NoveltyGuard.absent(len(predictor.frequency_hz))
    limits = {
        "threshold": calibrated.novelty_threshold,
        "relative_threshold": calibrated.relative_threshold,
    }
    return replace(predictor, guard=replace(guard, **limits))


def features_of(recordings: np.ndarray, settings: FeatureSettings = FEATURES) -> np.ndarray:
    """The package's features (n, n_bins)."""
    return np.array([spectrum(samples, RATE_HZ, settings) for samples in recordings])


def onnx_outputs(file, recordings):
    """Outputs of ONNX Runtime for each recording (n,), by name."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    options.log_severity_level = 4
    session = onnxruntime.InferenceSession(file, options, providers=["CPUExecutionProvider"])
    names = [output.name for output in session.get_outputs()]
    for samples in recordings:
        values = session.run(None, {"waveform": np.asarray(samples, np.float32)[np.newaxis]})
        yield {name: value[0] for name, value in zip(names, values, strict=True)}


def assert_agrees(predictor, outputs, features):
    """The outputs are those of the package for `features` (m, f), to 1e-4 of the largest value.

    All but the feature are compared for the features of the file, so that a class that the rounding
    of a feature turns is not an error.
    """
    from ajgdata.export import NOVELTY_VERDICTS

    predictions = predictor.of_features(np.array([o["feature"] for o in outputs], np.float32))
    own = {
        "feature": features,
        "novelty": [p.novelty for p in predictions],
        "probability": [list(p.probability.values()) for p in predictions],
        "value": [p.value for p in predictions],
    }
    for name in own.keys() & outputs[0].keys():
        reference = np.array(own[name], float)
        error = np.abs(np.array([output[name] for output in outputs], float) - reference)
        if name == "value" and (period := getattr(predictor.estimator, "period", None)):
            error = np.minimum(error, np.abs(period - error))
        assert error.max() <= 1e-4 * np.abs(reference).max(), name
    for output, prediction in zip(outputs, predictions, strict=True):
        if "class" in output:
            assert predictor.classes[int(output["class"])] == prediction.value
        assert NOVELTY_VERDICTS[int(output.get("verdict", 3))] == str(prediction.verdict)
