"""Trained model -> ONNX file, and the comparison of such a file with the package."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.live.prediction import Prediction
from ajgdata.live.predictor import Predictor
from ajgdata.loading import load_predictor, load_recordings
from ajgdata.paths import Paths
from ajgdata.pipeline.progress import Started
from ajgdata.pipeline.recordings import examine
from ajgdata.store.files import write_bytes
from ajgdata.store.models import read_about
from ajgdata.types import DataError, NotPossibleError

#: Largest difference of an output, relative to its largest value: both compute in float32.
TOLERANCE = 1e-4


def export_model(paths: Paths, dataset: str, task: str, model: str, *, folder: Path) -> Path:
    """Write the trained model of a task into `folder`; return the file.

    Raises DataError for a model that was not trained or cannot be exported, and if a package is
    missing.
    """
    predictor = load_predictor(dataset, task, model, paths.root)
    for package in ("onnx", "onnxruntime", "onnxscript"):
        if find_spec(package) is None:
            raise DataError(package, "is not installed", "pip install 'ajgdata[export]'")
    from ajgdata.export.onnx_file import onnx_bytes

    place = paths.model(dataset, task, model)
    try:
        content = onnx_bytes(predictor, describe(predictor, read_about(place)))
    except NotPossibleError as error:
        raise DataError(place, str(error), "export cnn, linear or ridge") from None
    file = folder / f"{dataset}-{task}-{model}.onnx"
    write_bytes(file, content)
    return file


def describe(predictor: Predictor, trained: Mapping[str, Any]) -> dict[str, Any]:
    """Return the metadata of the file; `trained` describes the training."""
    from ajgdata.export.onnx_file import VERDICTS

    provenance = trained["provenance"] | {
        key: trained[key] for key in ("seed", "target", "recordings")
    }
    return {
        "data_set": predictor.dataset,
        "task": predictor.task,
        "model": predictor.model,
        "kind": predictor.kind,
        "unit": predictor.unit,
        "period": trained["period"],
        "classes": list(predictor.classes),
        "sample_rate_hz": predictor.sample_rate_hz,
        "channel": predictor.audio.channel,
        "features": predictor.features.model_dump(mode="json"),
        "calibration": predictor.calibration.plain(),
        "verdicts": list(VERDICTS),
        "provenance": provenance,
    }


@dataclass(frozen=True)
class Difference:
    """The largest difference of one quantity over all recordings, and the largest allowed."""

    quantity: str
    largest: float
    allowed: float

    @property
    def is_beyond(self) -> bool:
        """True if the difference is too large; NaN is."""
        return not self.largest <= self.allowed


def check_export(
    paths: Paths, file: Path, names: Sequence[str], started: Started
) -> list[Difference]:
    """Compare an exported file with the trained model `names` (data set, task, model), over the
    recordings of the data set. `started(total)` returns a function to call per recording."""
    from ajgdata.export.onnx_file import OnnxModel
    from ajgdata.features.spectrum import spectrum

    dataset, task, model = names
    onnx, predictor = OnnxModel(file), load_predictor(dataset, task, model, paths.root)
    with load_recordings(dataset, paths.root) as recordings:
        files = [Path(str(path)) for path in recordings.file.values]
    advance = started(len(files))
    features, outputs = [], []
    for path in files:
        samples = examine(path, predictor.audio, predictor.features.window).samples
        if samples is not None:
            features.append(spectrum(samples, predictor.sample_rate_hz, predictor.features))
            outputs.append(onnx(samples))
        advance()
    return compare(predictor, np.array(features), outputs, onnx.about["period"])


def compare(
    predictor: Predictor,
    features: np.ndarray,
    outputs: Sequence[Mapping[str, Any]],
    period: float | None = None,
) -> list[Difference]:
    """Return the differences of a file's outputs; for classes and verdicts, how many differ.

    `features` (m, f) are the package's. All other quantities are compared for the features of the
    file, so that a vote that the rounding of a feature turns is not an error of the file.
    """
    exported = np.array([output["feature"] for output in outputs], np.float32)
    ours = predictor.of_features(exported)
    quantities = [("feature", exported, features)]
    quantities += [
        (name, np.array([output[name] for output in outputs], float), _values(ours, name))
        for name in ("novelty", "probability", "value")
        if name in outputs[0]
    ]
    differences = []
    for name, theirs, reference in quantities:
        turn = period if name == "value" else None
        allowed = TOLERANCE * float(np.abs(reference).max())
        differences.append(Difference(name, _largest(theirs, reference, turn), allowed))
    pairs = zip(ours, outputs, strict=True)
    turned = sum(_is_turned(*pair, predictor.classes) for pair in pairs)
    return [*differences, Difference("decisions", turned, 0)]


def _values(predictions: Sequence[Prediction], name: str) -> np.ndarray:
    if name == "probability":
        return np.array([list(one.probability.values()) for one in predictions])
    return np.array([getattr(one, name) for one in predictions], np.float64)


def _is_turned(ours: Prediction, output: Mapping[str, Any], classes: Sequence[str]) -> bool:
    from ajgdata.export.onnx_file import VERDICTS

    other_class = "class" in output and classes[int(output["class"])] != ours.value
    return other_class or VERDICTS[int(output.get("verdict", 3))] != str(ours.verdict)


def _largest(one: np.ndarray, other: np.ndarray, period: float | None) -> float:
    """Return the largest |one - other|, with a period the shorter way round."""
    error = np.abs(one - other)
    return float((error if period is None else np.minimum(error, np.abs(period - error))).max())
