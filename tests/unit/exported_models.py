"""Small trained models, and tones to train and to try them on."""

from __future__ import annotations

import numpy as np

from ajgdata.export.description import Exported, describe
from ajgdata.features.spectrum import spectra
from ajgdata.models import make_model
from ajgdata.types import AudioSettings, FeatureSettings

RATE_HZ = 8_000
AUDIO = AudioSettings(sample_rate_hz=RATE_HZ)
FEATURES = FeatureSettings(window=64, hop=32)
PERIOD = 4.0
#: What is asked of a model: its kind, and whether the target repeats.
QUESTIONS = ("classes", "two_classes", "number", "angle")
#: Fewer steps and trees than in use: what is exported has the same parts.
SMALLER = {
    "cnn": {"min_steps": 10, "epochs": 1},
    "boosting": {"max_iter": 4},
    "forest": {"n_estimators": 7},
    "mlp": {"max_iter": 400, "hidden_layer_sizes": (6,), "tol": 0.1, "n_iter_no_change": 2},
}


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
    return np.array([f"class {one}" for one in number // (2 if question == "two_classes" else 1)])


def trained(model: str, question: str, features: np.ndarray):
    """A fitted estimator."""
    kind = "regression" if question in ("number", "angle") else "classification"
    estimator = make_model(model, kind, 0, PERIOD if question == "angle" else None)
    wanted = SMALLER.get(model, {})
    every = estimator.get_params()
    names = {name: value for name, value in wanted.items()}
    for name in every:
        last = name.rpartition("__")[2]
        if last in names:
            estimator.set_params(**{name: names[last]})
    return estimator.fit(features, targets(question, len(features)))


def exported(
    estimator, question: str = "classes", features: FeatureSettings = FEATURES, **more
) -> Exported:
    """What a file of an estimator holds."""
    number = question in ("number", "angle")
    given = {
        "names": ("d", "t", "m"),
        "kind": "regression" if number else "classification",
        "unit": "mm" if number else "",
        "period": PERIOD if question == "angle" else None,
        "audio": AUDIO,
        "calibration": {
            "temperature": 1.5 if hasattr(estimator, "predict_proba") else None,
            "half_width": 0.25,
        },
        "guard": None,
        "provenance": {"git_commit": "0"},
    }
    return describe(estimator, features=features, **(given | more))


def features_of(recordings: np.ndarray, settings: FeatureSettings = FEATURES) -> np.ndarray:
    """The package's features (n, n_bins)."""
    return spectra(recordings, RATE_HZ, settings)
