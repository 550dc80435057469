"""What an exported model says of itself, whatever the file: settings, calibration, self-test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ajgdata.export import numpy_runtime
from ajgdata.export.layers import CannotExportError, Layer, layers_of
from ajgdata.features.spectrum import frequencies_hz
from ajgdata.features.windows import periodic_window
from ajgdata.types import AudioSettings, FeatureSettings

#: What of a model's calibration (`evaluate.in_use`) a file holds; None is what could not be found.
CALIBRATION: Mapping[str, Any] = {
    "temperature": None,
    "coverage": None,
    "half_width": None,
    "novelty_threshold": None,
    "false_alarm": None,
}
#: The test sound is a saw tooth that sweeps over all frequencies in 8 windows.
_MODULUS, _WINDOWS = 2**20, 8
_DRAWS = 8  # of features that differ by rounding
_EPSILON = float(np.finfo(np.float32).eps)


@dataclass(frozen=True, eq=False)
class Exported:
    """All of a model that a file needs.

    `about` can be held by JSON; `layers` are the model's steps; `window` (n,) is that of the
    transform, float32. `guard` has points (see `evaluate.novelty`) of `grasps` (g, f) and
    `references` (r, f), `mean`, `std` (f,) and `scale` (); None if novelty is not told.
    """

    about: Mapping[str, Any]
    layers: Sequence[Layer]
    window: np.ndarray
    guard: Mapping[str, np.ndarray] | None


def describe(
    estimator: Any,
    *,
    names: tuple[str, str, str],
    kind: str,
    unit: str,
    period: float | None,
    audio: AudioSettings,
    features: FeatureSettings,
    calibration: Mapping[str, Any],
    guard: Mapping[str, np.ndarray] | None,
    provenance: Mapping[str, Any],
) -> Exported:
    """Return what a file of a fitted `estimator` holds, its self-test included.

    `names` are data set, task and model; `calibration` as in CALIBRATION. Raises CannotExportError
    for a model and for features that no file of one recording can have.
    """
    if features.kind != "stft":
        raise CannotExportError(
            f"features of kind {features.kind} cannot be exported: they need the played sound"
        )
    if features.align:
        raise CannotExportError(
            "aligned features cannot be exported: they need the played sound (features.align)"
        )
    layers = layers_of(estimator)
    rate = audio.sample_rate_hz
    band = frequencies_hz(rate, features)
    first = round(band[0] * features.window / rate)
    about: dict[str, Any] = dict(zip(("data_set", "task", "model"), names, strict=True))
    about |= {"format": numpy_runtime.FORMAT, "kind": kind, "unit": unit, "period": period}
    about |= {"classes": [], "probabilities": False, "outputs": 1}
    if kind == "classification":
        classes = np.asarray(estimator.classes_).tolist()
        about |= {"classes": classes, "outputs": len(classes)}
        about["probabilities"] = calibration.get("temperature") is not None
    about |= {"sample_rate_hz": rate, "channel": audio.channel}
    about |= {"features": features.model_dump(mode="json"), "bins": [first, first + len(band)]}
    about["calibration"] = {key: calibration.get(key, CALIBRATION[key]) for key in CALIBRATION}
    about |= {"provenance": dict(provenance), "verdicts": list(numpy_runtime.VERDICTS)}
    window = periodic_window(features.window_shape, features.window).astype(np.float32)
    exported = Exported(about, layers, window, guard)
    about["self_test"] = self_test(exported)
    return exported


def in_numpy(exported: Exported) -> numpy_runtime.Model:
    """Return the model as the NumPy program has it."""
    arrays: dict[str, np.ndarray] = {"window": exported.window}
    layers: Any = [_plain(layer, arrays) for layer in exported.layers]
    for name, value in (exported.guard or {}).items():
        arrays[f"guard.{name}"] = np.asarray(value)
    return numpy_runtime.Model({**exported.about, "layers": layers}, arrays)


def _plain(layer: Layer, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    """Return a step as JSON can hold it; its arrays are put into `arrays` under the names it
    gives."""
    places = {}
    for name, value in layer.arrays.items():
        places[name] = f"{len(arrays)}.{layer.op}.{name}"
        arrays[places[name]] = value
    said: dict[str, Any] = {"op": layer.op, "arrays": places, "numbers": dict(layer.numbers)}
    if layer.branches:
        said["branches"] = [[_plain(one, arrays) for one in each] for each in layer.branches]
    return said


def feature_tolerance(window: int) -> float:
    """Return how far two float32 features of `window` samples may differ, relative to their 2-norm.

    A transform of N samples errs by a few units of rounding times log2 N, relative to the 2-norm
    (N. Higham, Accuracy and Stability of Numerical Algorithms, 2002, theorem 24.2).
    """
    return 4 * _EPSILON * float(np.log2(window))


def self_test(exported: Exported) -> dict[str, Any]:
    """Return a test sound as a recipe, what the model says of it, and how far that may differ.

    A model may amplify rounding, and one that counts votes may jump: the tolerance is four times
    the largest change of what it says when features change by as much as they may.
    """
    size = exported.about["features"]["window"]
    samples = _WINDOWS * size
    multiplier = max(
        1, _MODULUS // (4 * samples)
    )  # half a turn a sample, Nyquist, at twice its end
    sound = {"samples": samples, "multiplier": multiplier, "modulus": _MODULUS}
    model, period = in_numpy(exported), exported.about["period"]
    feature = model.feature(numpy_runtime.test_sound(sound))
    expected = numbers_of(model.of_feature(feature))
    allowed = feature_tolerance(size) * float(np.linalg.norm(feature))
    signs = np.random.default_rng(0).choice([-1.0, 1.0], (_DRAWS, len(feature)))
    changed = np.maximum(feature + signs * allowed / np.sqrt(len(feature)), 0)
    said = [numbers_of(model.of_feature(one)) for one in changed]
    tolerance = {"feature": allowed}
    for name, value in expected.items():
        largest = max(
            numpy_runtime.largest_difference(one[name], value, period, name) for one in said
        )
        scale = float(np.abs(value).max(initial=0))
        tolerance[name] = 4 * (largest + _EPSILON * scale)
    plain = {name: np.asarray(value, np.float64).tolist() for name, value in expected.items()}
    return {**sound, "expected": {"feature": feature.tolist(), **plain}, "tolerance": tolerance}


def numbers_of(said: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a prediction of the NumPy program says in numbers."""
    probability = list(said["probability"].values())
    numbers = {"score": said["score"], "probability": probability, "novelty": said["novelty"]}
    return {name: value for name, value in numbers.items() if value is not None}
