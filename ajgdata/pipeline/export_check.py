"""An exported file beside the package, recording by recording."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.export.comparison import Difference, feature_difference, score_difference
from ajgdata.export.running import OnnxModel, Said, numpy_about, numpy_answers
from ajgdata.features.spectrum import spectrum
from ajgdata.loading import load_recordings, read_model
from ajgdata.paths import EXPORT_PROGRAM, Paths
from ajgdata.pipeline.export_model import settings_of
from ajgdata.pipeline.recordings import examine
from ajgdata.store.scan import AUDIO_SUFFIXES
from ajgdata.types import AudioSettings, DataError, FeatureSettings

Started = Callable[[int], Callable[[], object]]


@dataclass
class Checked:
    """An exported file beside the package, over recordings.

    `turned` are recordings of which the file names another class than the package does of the same
    feature; `turned_by_rounding` those where it is the feature's rounding that turns it. `left_out`
    are recordings that the package itself cannot use; `refused` counts, by reason, those that only
    the file cannot.
    """

    recordings: int
    differences: list[Difference]
    turned: int = 0
    turned_by_rounding: int = 0
    left_out: int = 0
    refused: Counter[str] = field(default_factory=Counter)

    @property
    def is_wrong(self) -> bool:
        """True if the file does not say what the package says, or of nothing."""
        beyond = any(one.is_beyond for one in self.differences)
        return beyond or bool(self.turned) or not self.recordings


def check_export(paths: Paths, file: Path, folder: Path | None, started: Started) -> Checked:
    """Return how far an exported file is from the package.

    Over the recordings of the model's data set, or all audio files in `folder`. Raises DataError
    for a file that is damaged, whose self-test fails, or whose model is no longer there.
    """
    onnx = OnnxModel(file) if file.suffix == ".onnx" else None
    about = onnx.about if onnx else numpy_about(file)
    estimator, known = read_model(paths.model(about["data_set"], about["task"], about["model"]))
    audio, settings = settings_of(known)
    _same(file, about, estimator, known, audio, settings)
    files, features, answers = _files(paths, about["data_set"], folder), [], []
    advance, names = started(len(files)), []
    for path in files:
        samples = examine(path, audio, settings.window).samples
        if samples is not None:
            names.append(str(path))
            features.append(spectrum(samples, audio.sample_rate_hz, settings))
            if onnx:
                answers.append(onnx(samples))
        advance()
    if onnx is None:
        answers = list(numpy_answers(file.with_name(EXPORT_PROGRAM), file, names))
    refused = Counter(str(said["error"]) for said in answers if "error" in said)
    used = [n for n, said in enumerate(answers) if "error" not in said]
    said = [answers[n] for n in used]
    checked = _compared(estimator, about, np.array([features[n] for n in used]), said)
    checked.left_out, checked.refused = len(files) - len(names), refused
    return checked


def _compared(
    estimator: Any, about: Mapping[str, Any], features: np.ndarray, said: Sequence[Said]
) -> Checked:
    """Return the comparison of what was said of recordings with features (n, n_bins)."""
    if not said:
        return Checked(0, [])
    theirs = np.array([one["feature"] for one in said], np.float32)
    checked = Checked(
        len(said), [feature_difference(features, theirs, about["features"]["window"])]
    )
    score = np.array([one["score"] for one in said], np.float64)
    if not about["classes"] or about["probabilities"]:
        scores = _scores(estimator, about)
        checked.differences.append(score_difference(scores, theirs, score, about["period"]))
    if about["classes"]:
        named = np.array([one["value"] for one in said])
        checked.turned = int(np.count_nonzero(estimator.predict(theirs) != named))
        checked.turned_by_rounding = int(np.count_nonzero(estimator.predict(features) != named))
    return checked


def _scores(estimator: Any, about: Mapping[str, Any]) -> Callable[[np.ndarray], np.ndarray]:
    """Return what gives the scores (n, n_outputs) of features."""
    if about["classes"]:
        return estimator.predict_proba
    return lambda features: estimator.predict(features).reshape(len(features), -1)


def _same(
    file: Path,
    about: Mapping[str, Any],
    estimator: Any,
    known: Mapping[str, Any],
    audio: AudioSettings,
    settings: FeatureSettings,
) -> None:
    """Raise DataError if a file was made of another training of the model, or tampered with."""
    classes = [] if known["kind"] == "regression" else estimator.classes_.tolist()
    pairs = {
        "classes": (about["classes"], classes),
        "sample rate": (about["sample_rate_hz"], audio.sample_rate_hz),
        "channel": (about["channel"], audio.channel),
        "features": (about["features"], settings.model_dump(mode="json")),
        "unit": (about["unit"], known["unit"]),
        "provenance": (about["provenance"].items() >= known["provenance"].items(), True),
    }
    for what, (theirs, ours) in pairs.items():
        if theirs != ours:
            problem = f"its {what} is not that of the trained model"
            raise DataError(file, problem, "export it again")


def _files(paths: Paths, dataset: str, folder: Path | None) -> list[Path]:
    """Return the recordings of a data set, or all audio files in a folder."""
    if folder is None:
        with load_recordings(dataset, paths.root) as recordings:
            return [Path(str(file)) for file in recordings.file.values]
    files = sorted(one for one in folder.rglob("*") if one.suffix.lower() in AUDIO_SUFFIXES)
    if not files:
        raise DataError(folder, "holds no recordings", "name the folder that holds them")
    return files
