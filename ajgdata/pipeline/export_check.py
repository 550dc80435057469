"""An exported file beside the package, recording by recording."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.export.comparison import Difference, Says, difference, feature_difference
from ajgdata.export.description import CALIBRATION
from ajgdata.export.numpy_runtime import largest_difference
from ajgdata.export.running import OnnxModel, Said, numpy_about, numpy_answers
from ajgdata.features.spectrum import spectrum
from ajgdata.live.prediction import Prediction
from ajgdata.live.predictor import Predictor
from ajgdata.loading import load_recordings, read_predictor
from ajgdata.paths import EXPORT_PROGRAM, Paths
from ajgdata.pipeline.export_model import provenance
from ajgdata.pipeline.recordings import examine
from ajgdata.store.models import read_about
from ajgdata.store.scan import AUDIO_SUFFIXES
from ajgdata.types import NAME, DataError

Started = Callable[[int], Callable[[], object]]


@dataclass
class Checked:
    """An exported file beside the package, over recordings.

    `turned` are recordings of which the file gives another class or verdict than the package does
    of the same feature; `turned_by_rounding` those where it is the feature's rounding that turns
    it. `end_to_end` is the largest difference of a probability, or number, from recording to
    answer. `left_out` are recordings that the package itself cannot use; `refused` counts, by
    reason, those that only the file cannot.
    """

    recordings: int
    differences: list[Difference]
    turned: int = 0
    turned_by_rounding: int = 0
    end_to_end: float | None = None
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
    dataset, task, model = names_in(file, about)
    place = paths.model(dataset, task, model)
    if not place.is_dir():
        problem = f"the model that it was made of is not there ({place})"
        raise DataError(file, problem, "run `snakemake`, or check it where it was made")
    predictor = read_predictor(place, dataset, task)
    _same(file, about, predictor, read_about(place))
    audio, settings = predictor.audio, predictor.features
    files, features, answers = _files(paths, dataset, folder), [], []
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
    used = [n for n, said in enumerate(answers) if "error" not in said]
    said = [answers[n] for n in used]
    checked = _compared(predictor, about, np.array([features[n] for n in used]), said)
    checked.left_out = len(files) - len(names)
    checked.refused = Counter(str(one["error"]) for one in answers if "error" in one)
    return checked


def names_in(file: Path, about: Mapping[str, Any]) -> tuple[str, str, str]:
    """Return data set, task and model that a file says it is of. Raises DataError for what is no
    name: a file that came from elsewhere may say anything, and folders are named by it."""
    names = [about.get(key) for key in ("data_set", "task", "model")]
    if not all(isinstance(one, str) and NAME.fullmatch(one) for one in names):
        raise DataError(file, "does not say what it was made of", "export it again")
    dataset, task, model = map(str, names)
    return dataset, task, model


def _compared(
    predictor: Predictor, about: Mapping[str, Any], ours: np.ndarray, said: Sequence[Said]
) -> Checked:
    """Return the comparison of what was said of recordings with features `ours` (n, n_bins)."""
    if not said:
        return Checked(0, [])
    theirs = np.array([one["feature"] for one in said], np.float32)
    checked = Checked(len(said), [feature_difference(ours, theirs, predictor.features.window)])
    for quantity, (says, values) in _quantities(predictor, said).items():
        period = about["period"] if quantity in ("score", "interval") else None
        checked.differences.append(difference(quantity, says, theirs, values, period))
    answers = [(one["value"], one["verdict"]) for one in said]
    numbers = not predictor.classes
    checked.turned = _turned(predictor.of_features(theirs), answers, numbers)
    from_recordings = predictor.of_features(ours)
    checked.turned_by_rounding = _turned(from_recordings, answers, numbers)
    if numbers or predictor.has_probabilities:
        whole = [[one.value] if numbers else [*one.probability.values()] for one in from_recordings]
        got = [[one["value"]] if numbers else [*one["probability"].values()] for one in said]
        checked.end_to_end = largest_difference(got, whole, about["period"])
    return checked


def _turned(ours: Sequence[Prediction], theirs: Sequence[tuple], numbers: bool) -> int:
    """Return how many verdicts, or classes, are not the same."""
    return sum(
        str(one.verdict) != verdict or (not numbers and one.value != value)
        for one, (value, verdict) in zip(ours, theirs, strict=True)
    )


def _quantities(predictor: Predictor, said: Sequence[Said]) -> dict[str, tuple[Says, np.ndarray]]:
    """Return, by name, what gives a quantity (n, k) of features, and what the file says of it."""
    estimator: Any = predictor.estimator

    def of(take: Callable[[Prediction], Any]) -> Says:
        return lambda features: np.array([take(one) for one in predictor.of_features(features)])

    def theirs(take: Callable[[Said], Any]) -> np.ndarray:
        return np.array([take(one) for one in said], np.float64)

    found: dict[str, tuple[Says, np.ndarray]] = {}
    if predictor.guard.can_check:
        found["novelty"] = (of(lambda one: [one.novelty]), theirs(lambda one: [one["novelty"]]))
    if not predictor.classes:
        says = of(lambda one: [one.value])
        found["score"] = (says, theirs(lambda one: one["score"]))
        if predictor.calibration.half_width is not None:
            says = of(lambda one: one.interval)
            found["interval"] = (says, theirs(lambda one: one["interval"]))
    elif predictor.has_probabilities:
        found["score"] = (estimator.predict_proba, theirs(lambda one: one["score"]))
        says = of(lambda one: [*one.probability.values()])
        found["probability"] = (says, theirs(lambda one: [*one["probability"].values()]))
    return found


def _same(
    file: Path, about: Mapping[str, Any], predictor: Predictor, trained: Mapping[str, Any]
) -> None:
    """Raise DataError if a file was made of another training of the model, or tampered with."""
    calibration = predictor.calibration.plain()
    own = {
        "provenance": provenance(trained),
        "kind": predictor.kind,
        "classes": list(predictor.classes),
        "probabilities": predictor.has_probabilities,
        "unit": predictor.unit,
        "period": trained["period"],
        "sample_rate_hz": predictor.sample_rate_hz,
        "channel": predictor.audio.channel,
        "features": predictor.features.model_dump(mode="json"),
        "calibration": {key: calibration[key] for key in CALIBRATION},
    }
    for what, ours in own.items():
        if about.get(what) != ours:
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
