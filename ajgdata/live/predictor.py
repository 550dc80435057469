"""A trained model in use: one recording in, a prediction with its uncertainty out.

Checks and features are those of the workflow: a recording that the workflow would not use is
refused in its words, and one that it did use gives the feature of the store.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ajgdata.evaluate.calibration import with_temperature
from ajgdata.evaluate.in_use import Calibration
from ajgdata.evaluate.novelty import NoveltyGuard
from ajgdata.features.checks import BEYOND, check_audio
from ajgdata.features.spectrum import frequencies_hz, spectrum
from ajgdata.store.audio import Audio, AudioInfo, read_audio
from ajgdata.types import AudioSettings, DataError, FeatureSettings, Kind

if TYPE_CHECKING:
    from sklearn.base import BaseEstimator

#: Samples beyond this are of another scale: converters of ±1 clip, volts stay far below.
MAX_PEAK = 100.0
#: What samples that came from no file are called in complaints.
HERE = Path("this recording")


class Verdict(StrEnum):
    """Whether a prediction is about something that the model knows."""

    KNOWN = "known"  #: not novel, by a guard that detects at least half of the novel objects
    NOTHING = "nothing"  #: nearer to recordings of an empty gripper, or of silence, than to any
    UNKNOWN = "unknown"  #: further from what was trained on than recordings of new grasps are
    NO_SIGN = "no sign"  #: not flagged, by a guard that detects too few novel objects
    NOT_CHECKED = "not checked"  #: the model has no threshold for novel objects


@dataclass(frozen=True)
class Prediction:
    """One recording as a trained model sees it.

    `value` is the most probable class, or the number in `unit`; it is given for every verdict, and
    meaningless for NOTHING and UNKNOWN. `probability` is calibrated, by class in the order of
    the model's classes (empty for numbers, and for models without probabilities). `interval` holds
    the true number with the model's stated coverage (None for classes). `novelty` is the distance
    to training grasps or objects in units of its threshold: above 1 is UNKNOWN; None if it was NOT
    CHECKED. `detection_rate` is the share of novel objects that this check detects (None if it was
    not measured); below one half, the verdict is NO_SIGN instead of KNOWN. `remarks` are the
    warnings of the checks of the recording, one line each.
    """

    kind: Kind
    value: str | float
    unit: str
    verdict: Verdict
    novelty: float | None
    probability: Mapping[str, float]
    interval: tuple[float, float] | None = None
    remarks: Sequence[str] = ()
    detection_rate: float | None = None

    def plain(self) -> dict[str, Any]:
        """Return it as JSON can hold it."""
        interval = None if self.interval is None else list(self.interval)
        plain = {"verdict": str(self.verdict), "probability": dict(self.probability)}
        return vars(self) | plain | {"interval": interval, "remarks": list(self.remarks)}


@dataclass(frozen=True, eq=False)
class Predictor:
    """A model trained for a task of a data set, with its calibration. See `load_predictor`.

    `classes` are sorted (none for numbers); `audio` and `features` are the data set's settings.
    Raises ValueError for features that a single recording does not give.
    """

    estimator: BaseEstimator
    dataset: str
    task: str
    model: str
    kind: Kind
    unit: str
    classes: tuple[str, ...]
    audio: AudioSettings
    features: FeatureSettings
    calibration: Calibration
    guard: NoveltyGuard

    def __repr__(self) -> str:
        """Return data set, task, model, what it predicts, and the rate of recordings."""
        predicts = f"one of {len(self.classes)} classes" if self.classes else "a number"
        if self.unit:
            predicts += f" in {self.unit}"
        name = f"{self.dataset}/{self.task}/{self.model}"
        return f"<Predictor {name}: predicts {predicts} from {self.sample_rate_hz} Hz recordings>"

    @property
    def sample_rate_hz(self) -> int:
        """Return the rate of recordings as the model knows them."""
        return self.audio.sample_rate_hz

    @property
    def frequency_hz(self) -> NDArray[np.float64]:
        """Return the frequencies (f,) of a feature."""
        return frequencies_hz(self.sample_rate_hz, self.features)

    @property
    def has_probabilities(self) -> bool:
        """Return whether predictions come with calibrated probabilities, as sorting needs them."""
        return self.calibration.temperature is not None

    @property
    def has_references(self) -> bool:
        """Return whether the model has recordings of the empty gripper to recognise it by."""
        return len(self.guard.references) > 0

    @property
    def novelty_note(self) -> str:
        """Return why no prediction is called known, in a clause; "" if some are."""
        if not self.guard.can_check:
            return "novelty is not checked"
        rate = self.calibration.detection_rate
        if rate is None:
            return "the detection rate of the novelty check is not measured"
        if self.calibration.detects_novel_objects:
            return ""
        return f"the novelty check detects only {100 * rate:.0f} % of novel objects"

    def with_references(self, features: np.ndarray) -> Self:
        """Return the same with features (r, f) of further recordings in which nothing is held.

        Raises ValueError for arrays of another shape, NaN and infinity.
        """
        return replace(self, guard=self.guard.with_references(features))

    def feature(self, waveform: ArrayLike, sample_rate_hz: float) -> NDArray[np.float32]:
        """Return the feature (f,) of one recording, as `predict` makes it."""
        audio = _audio(waveform, sample_rate_hz, self.audio)
        return self._feature_and_remarks(audio, HERE)[0]

    def predict(self, waveform: ArrayLike, sample_rate_hz: float) -> Prediction:
        """Return what the model says of one recording.

        `waveform` (n,) floats at the sample rate of the model, full scale ±1. Raises DataError for
        other waveforms, and for what the workflow would not use: too short, NaN, silence.
        """
        return self._predicted(_audio(waveform, sample_rate_hz, self.audio), HERE)

    def predict_file(self, path: str | Path) -> Prediction:
        """Return the prediction for one audio file. Raises DataError as `predict` does."""
        return self._predicted(read_audio(Path(path), self.audio), Path(path))

    def of_features(self, features: np.ndarray) -> list[Prediction]:
        """Return what the model says of features (m, f), as `feature` or a store gives them."""
        features = np.asarray(features, np.float32)
        if features.ndim != 2 or features.shape[1] != len(self.guard.mean):
            raise ValueError(f"need features (m, {len(self.guard.mean)}), not {features.shape}")
        nothing = self.guard.is_nothing(features)
        checks = self.guard.can_check
        novelty = self.guard.novelty(features).tolist() if checks else [None] * len(features)
        model: Any = self.estimator
        if self.kind == "regression":
            values, table = model.predict(features).astype(float), None
        elif self.calibration.temperature is None:
            values, table = model.predict(features), None
        else:
            table = with_temperature(model.predict_proba(features), self.calibration.temperature)
            values = np.array(self.classes)[table.argmax(axis=1)]
        return [
            Prediction(
                kind=self.kind,
                value=value,
                unit=self.unit,
                verdict=self._verdict(bool(nothing[row]), far),
                novelty=far,
                probability={}
                if table is None
                else dict(zip(self.classes, table[row].tolist(), strict=True)),
                interval=self._interval(value),
                detection_rate=self.calibration.detection_rate if checks else None,
            )
            for row, (value, far) in enumerate(zip(values.tolist(), novelty, strict=True))
        ]

    def _verdict(self, nothing: bool, novelty: float | None) -> Verdict:
        if nothing:
            return Verdict.NOTHING
        if novelty is None:
            return Verdict.NOT_CHECKED
        if novelty > 1:
            return Verdict.UNKNOWN
        return Verdict.KNOWN if self.calibration.detects_novel_objects else Verdict.NO_SIGN

    def _interval(self, value: Any) -> tuple[float, float] | None:
        half = self.calibration.half_width
        return None if half is None else (value - half, value + half)

    def _predicted(self, audio: Audio, where: Path) -> Prediction:
        feature, remarks = self._feature_and_remarks(audio, where)
        return replace(self.of_features(feature[np.newaxis])[0], remarks=remarks)

    def _feature_and_remarks(
        self, audio: Audio, where: Path
    ) -> tuple[NDArray[np.float32], Sequence[str]]:
        """Return the feature (f,) of a recording, and warnings about it. Raises DataError."""
        remarks = check_audio(audio, self.features.window, self.features.band_hz)
        for remark in remarks:
            if remark.level == "error":
                raise DataError(where, remark.problem, remark.fix)
        try:
            feature = spectrum(audio.samples, self.sample_rate_hz, self.features)
        except ValueError as error:  # not normalised, and beyond float32
            raise DataError(where, str(error), "change features in dataset.yaml") from None
        shown = [remark for remark in remarks if remark.level == "warning" or remark.code == BEYOND]
        return feature, [f"{remark.problem}; {remark.fix}" for remark in shown]


def _audio(waveform: ArrayLike, sample_rate_hz: float, settings: AudioSettings) -> Audio:
    """Return samples (n,) as `read_audio` would return them from a file of floats.

    Raises DataError for other types, shapes and rates, and if full scale is not ±1.
    """
    array = np.asarray(waveform)
    if array.dtype.kind != "f" or array.ndim != 1:
        fix = "give floats (n,), with full scale ±1 (divide 16-bit integers by 32768)"
        raise DataError(HERE, f"samples are {array.dtype} of shape {array.shape}", fix)
    finite = array[np.isfinite(array)]
    if finite.size and (peak := float(np.abs(finite).max())) > MAX_PEAK:
        fix = "divide by full scale (32768 for 16-bit samples), so that full scale is ±1"
        raise DataError(HERE, f"the peak is {peak:.4g}, of a full scale of 1", fix)
    rate_hz = settings.sample_rate_hz
    if sample_rate_hz != rate_hz:
        problem = f"sampled at {sample_rate_hz:g} Hz, not {rate_hz} Hz"
        raise DataError(HERE, problem, f"resample it to {rate_hz} Hz")
    with np.errstate(over="ignore"):  # infinity is for the checks
        samples = array.astype(np.float32)
    return Audio(
        samples, samples[:, np.newaxis], AudioInfo("", "FLOAT", rate_hz, 1, len(array)), ()
    )
