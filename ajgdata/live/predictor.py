"""A trained model in use: it predicts one recording, with the uncertainty of the prediction.

Checks and features are those of the workflow. A recording that the workflow would quarantine is
refused with the same message, and a recording of the workflow has the same feature.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ajgdata.evaluate.calibration import with_temperature
from ajgdata.evaluate.in_use import Calibration
from ajgdata.evaluate.novelty import NoveltyGuard
from ajgdata.features.checks import BEYOND_FULL_SCALE, check_audio
from ajgdata.features.compute import FeatureComputer
from ajgdata.store.audio import Audio, AudioInfo, read_audio
from ajgdata.store.feature_array import FREQUENCY
from ajgdata.types import AudioSettings, DataError, FeatureKind, Kind
from ajgdata.types.input_layout import Covariate
from ajgdata.types.settings import numbers_of

if TYPE_CHECKING:
    from sklearn.base import BaseEstimator

#: Samples with a larger peak have another scale, for example 16-bit integers: samples relative to
#: full scale end at 1, and voltages of a microphone are far below this limit.
MAX_PEAK = 100.0
#: A class, a number, or the numbers of a vector.
Value = str | float | tuple[float, ...]
#: Name, in error messages, of samples that are not from a file.
HERE = Path("this recording")


class NoveltyVerdict(StrEnum):
    """Whether the model knows the object of a prediction."""

    KNOWN = "known"  #: not novel, by a guard that detects at least half of the novel objects
    NOTHING = "nothing"  #: nearer to references or to silence than to any training recording
    UNKNOWN = "unknown"  #: farther from the training recordings than new grasps are
    NO_SIGN = "no sign"  #: not flagged, by a guard that detects too few novel objects
    NOT_CHECKED = "not checked"  #: the model has no threshold for novel objects


@dataclass(frozen=True)
class Prediction:
    """The prediction of a trained model for one recording.

    - `value` is the most probable class, or the number or vector in `unit`. It has no meaning if
      the verdict is NOTHING or UNKNOWN.
    - `probability` has the calibrated probability of each class, in the order of the model's
      classes. It is empty for numbers and for models without probabilities.
    - `interval` contains the true number with the model's stated coverage (None for classes). For a
      vector, both ends are vectors; the stated coverage is that of the circle or sphere inside.
    - `novelty` is the distance to training grasps or objects, divided by its threshold. Above 1,
      the verdict is UNKNOWN. It is None if the verdict is NOT_CHECKED.
    - `detection_rate` is the share of novel objects that this check detects (None if it was not
      measured). Below one half, the verdict is NO_SIGN instead of KNOWN.
    - `remarks` are the warnings of the checks of the recording, one line each.
    """

    kind: Kind
    value: Value
    unit: str
    verdict: NoveltyVerdict
    novelty: float | None
    probability: Mapping[str, float]
    interval: tuple[Any, Any] | None = None
    remarks: Sequence[str] = ()
    detection_rate: float | None = None

    def plain(self) -> dict[str, Any]:
        """Return the fields as values of JSON."""
        interval = None if self.interval is None else list(self.interval)
        return vars(self) | {
            "verdict": str(self.verdict),
            "probability": dict(self.probability),
            "interval": interval,
            "remarks": list(self.remarks),
        }


@dataclass(frozen=True, eq=False)
class Predictor:
    """A model trained for a task of a data set, with its calibration. See `load_predictor`.

    `classes` are sorted (empty for numbers). `audio` and `features` are settings of the data set,
    whose dataset.yaml is in `folder`. A model with `covariates` needs their values.
    """

    estimator: BaseEstimator
    dataset: str
    task: str
    model: str
    kind: Kind
    unit: str
    classes: tuple[str, ...]
    audio: AudioSettings
    features: FeatureKind
    calibration: Calibration
    guard: NoveltyGuard
    axes: tuple[str, ...] = ()  #: names of the numbers of a vector
    covariates: tuple[Covariate, ...] = ()
    folder: Path = Path()

    def __repr__(self) -> str:
        """Return data set, task, model, what it predicts, and the rate of recordings."""
        predicts = f"one of {len(self.classes)} classes" if self.classes else "a number"
        if self.axes:
            predicts = f"a vector of {', '.join(self.axes)}"
        if self.unit:
            predicts += f" in {self.unit}"
        name = f"{self.dataset}/{self.task}/{self.model}"
        columns = self.features.table_columns
        source = f"{self.sample_rate_hz} Hz recordings"
        if columns:
            source = f"{len(columns)} columns of a table"
        if self.covariates:
            source += f" and {', '.join(covariate.name for covariate in self.covariates)}"
        return f"<Predictor {name}: predicts {predicts} from {source}>"

    @property
    def sample_rate_hz(self) -> int:
        """Return the sample rate of the recordings that the model can predict."""
        return self.audio.sample_rate_hz

    @cached_property
    def _computer(self) -> FeatureComputer:
        return FeatureComputer(self.audio, self.features, self.folder)

    @property
    def frequency_hz(self) -> NDArray[np.float64]:
        """Return the frequencies (f,) of a spectrum. Raises ValueError for other features."""
        for axis in self._computer.axes:
            if axis.name == FREQUENCY:
                return axis.values
        raise ValueError(f"the feature {self.features.kind} has no frequencies")

    @property
    def has_probabilities(self) -> bool:
        """Return whether predictions have calibrated probabilities. Sorting requires them."""
        return self.calibration.temperature is not None

    @property
    def has_references(self) -> bool:
        """Return whether the model has references, by which it recognises the empty gripper."""
        return len(self.guard.references) > 0

    @property
    def novelty_note(self) -> str:
        """Return why no verdict is KNOWN, as a clause; "" if there can be such verdicts."""
        if not self.guard.can_check:
            return "novelty is not checked"
        rate = self.calibration.detection_rate
        if rate is None:
            return "the detection rate of the novelty check is not measured"
        if self.calibration.detects_novel_objects:
            return ""
        return f"the novelty check detects only {100 * rate:.0f} % of novel objects"

    def with_references(self, features: np.ndarray) -> Self:
        """Return a copy with the features (r, f) of further references.

        Raises ValueError for arrays of another shape, NaN and infinity.
        """
        return replace(self, guard=self.guard.with_references(features))

    def feature(
        self, waveform: ArrayLike, sample_rate_hz: float, played: ArrayLike | None = None
    ) -> NDArray[np.float32]:
        """Return the feature (f,) of one recording, as `predict` computes it."""
        audio = _audio(waveform, sample_rate_hz, self.audio)
        return self._feature_and_remarks(audio, HERE, played)[0]

    def predict(
        self,
        waveform: ArrayLike,
        sample_rate_hz: float,
        played: ArrayLike | None = None,
        covariates: Mapping[str, float] | None = None,
    ) -> Prediction:
        """Return the prediction for one recording.

        `waveform` (n,) are floats at the sample rate of the model, with full scale ±1; a model of
        several microphones needs (channels, n). `played` (m,) is the played sound, which only a
        transfer function with `reference: played` needs. `covariates` are the values by name that a
        model with covariates needs. Raises DataError for other waveforms, for recordings that the
        workflow would quarantine (too short, NaN, silence), and for other covariates.
        """
        audio = _audio(waveform, sample_rate_hz, self.audio)
        return self._predicted(audio, HERE, played, covariates)

    def predict_file(
        self,
        path: str | Path,
        played: ArrayLike | None = None,
        covariates: Mapping[str, float] | None = None,
    ) -> Prediction:
        """Return the prediction for one audio file. Raises DataError as `predict` does."""
        return self._predicted(read_audio(Path(path), self.audio), Path(path), played, covariates)

    def of_features(
        self, features: np.ndarray, covariates: Mapping[str, ArrayLike] | None = None
    ) -> list[Prediction]:
        """Return the predictions for features (m, f), from `feature` or a feature file.

        `covariates` has the values (m,) of each covariate of the model by name, or one number for
        all features. A value outside the training values is a remark. Raises ValueError for another
        number of values per feature, and DataError for other covariates.
        """
        features = np.asarray(features, np.float32)
        if features.ndim != 2 or features.shape[1] != len(self.guard.mean):
            raise ValueError(f"need features (m, {len(self.guard.mean)}), not {features.shape}")
        nothing = self.guard.is_empty_gripper(features)
        novelty: list[float | None] = [None] * len(features)
        detection_rate = None
        if self.guard.can_check:
            novelty = self.guard.novelty(features).tolist()
            detection_rate = self.calibration.detection_rate
        columns = self.covariate_columns(covariates or {}, len(features))
        inputs = np.column_stack([features, *columns]) if columns else features
        values, probabilities = self._values_and_probabilities(inputs)
        return [
            Prediction(
                kind=self.kind,
                value=value,
                unit=self.unit,
                verdict=self._verdict(bool(nothing[row]), novelty[row]),
                novelty=novelty[row],
                probability=probabilities[row],
                interval=self._interval(value),
                remarks=self._outside_training([column[row] for column in columns]),
                detection_rate=detection_rate,
            )
            for row, value in enumerate(values)
        ]

    def covariate_columns(
        self, covariates: Mapping[str, ArrayLike], count: int = 1
    ) -> list[NDArray[np.float64]]:
        """Return the values (count,) of each covariate of the model, in its order.

        `covariates` has one number, or `count` numbers, by name. Raises DataError for a covariate
        that is missing or unknown, for another shape, and for a value that is no finite number.
        """
        names = [covariate.name for covariate in self.covariates]
        where = f"model {self.model} of {self.dataset}/{self.task}"
        for name in covariates:
            if name not in names:
                known = f"it has {', '.join(names)}" if names else "it has none"
                raise DataError(where, f"has no covariate {name!r}", f"remove it: {known}")
        columns = []
        for name in names:
            if name not in covariates:
                fix = f"give it: covariates={{{name!r}: …}}, or `--covariate {name}=…`"
                raise DataError(where, f"needs a value of the covariate {name!r}", fix)
            fix = "give one number" if count == 1 else f"give one number, or {count} numbers"
            try:
                column = np.asarray(covariates[name])
            except ValueError:  # lists of different lengths
                raise DataError(where, f"the covariate {name!r} is no array", fix) from None
            if column.shape not in ((), (count,)):
                problem = f"the covariate {name!r} has the shape {column.shape}"
                raise DataError(where, problem, fix)
            column = np.broadcast_to(column, count)
            is_real = column.dtype.kind in "biuf"
            wrong = column[~np.isfinite(column)] if is_real else column
            if len(wrong):
                problem = f"the covariate {name!r} is {wrong[0]}, not a number"
                raise DataError(where, problem, fix)
            columns.append(column.astype(np.float64))
        return columns

    def _outside_training(self, values: Sequence[float]) -> list[str]:
        """Return a remark on each value of a covariate that is outside its training values."""
        return [
            f"{covariate.name} {value:g} is outside its training values, "
            f"{covariate.least:g} to {covariate.largest:g}; expect a larger error"
            for covariate, value in zip(self.covariates, values, strict=True)
            if not covariate.least <= value <= covariate.largest
        ]

    def _values_and_probabilities(
        self, features: np.ndarray
    ) -> tuple[Sequence[Value], list[dict[str, float]]]:
        """Return the value of each of the inputs (m, f + c), and its probability of each class.

        A model without calibrated probabilities has no probability of any class.
        """
        model: Any = self.estimator
        temperature = self.calibration.temperature
        if self.kind == "regression" or temperature is None:
            predicted = model.predict(features)
            if self.kind == "regression":
                predicted = predicted.astype(float)
            if self.axes:
                return [tuple(vector) for vector in predicted.tolist()], [{} for _ in features]
            return predicted.tolist(), [{} for _ in features]
        table = with_temperature(model.predict_proba(features), temperature)
        classes = np.array(self.classes)
        probabilities = [dict(zip(self.classes, row.tolist(), strict=True)) for row in table]
        return classes[table.argmax(axis=1)].tolist(), probabilities

    def _verdict(self, nothing: bool, novelty: float | None) -> NoveltyVerdict:
        if nothing:
            return NoveltyVerdict.NOTHING
        if novelty is None:
            return NoveltyVerdict.NOT_CHECKED
        if novelty > 1:
            return NoveltyVerdict.UNKNOWN
        return (
            NoveltyVerdict.KNOWN
            if self.calibration.detects_novel_objects
            else NoveltyVerdict.NO_SIGN
        )

    def _interval(self, value: Any) -> tuple[Any, Any] | None:
        half = self.calibration.half_width
        if half is None:
            return None
        if self.axes:
            return tuple(x - half for x in value), tuple(x + half for x in value)
        return value - half, value + half

    def _predicted(
        self,
        audio: Audio,
        where: Path,
        played: ArrayLike | None,
        covariates: Mapping[str, float] | None,
    ) -> Prediction:
        feature, remarks = self._feature_and_remarks(audio, where, played)
        prediction = self.of_features(feature[np.newaxis], covariates)[0]
        return replace(prediction, remarks=[*remarks, *prediction.remarks])

    def _feature_and_remarks(
        self, audio: Audio, where: Path, played: ArrayLike | None
    ) -> tuple[NDArray[np.float32], Sequence[str]]:
        """Return the feature (f,) of a recording, and its warnings.

        Raises DataError for a recording that the workflow would quarantine.
        """
        computer = self._computer
        if not computer.needs_waveform:
            problem = "the model predicts from columns of a table, not from sound"
            raise DataError(where, problem, "use `of_features` with rows of a feature file")
        microphones = numbers_of(self.audio.microphone)
        remarks = check_audio(audio, computer.least_samples, computer.reaching_hz, microphones)
        for remark in remarks:
            if remark.level == "error":
                raise DataError(where, remark.problem, remark.fix)
        try:
            feature = computer(audio.samples, None if played is None else np.asarray(played))
        except ValueError as error:  # not normalised, and beyond float32
            raise DataError(where, str(error), "change features in dataset.yaml") from None
        shown = [
            remark
            for remark in remarks
            if remark.level == "warning" or remark.code == BEYOND_FULL_SCALE
        ]
        texts = [f"{remark.problem}; {remark.fix}" for remark in shown]
        texts += [f"{problem}; {fix}" for _, problem, fix in feature.doubts]
        return feature.values.ravel(), texts


def _audio(waveform: ArrayLike, sample_rate_hz: float, settings: AudioSettings) -> Audio:
    """Return samples (n,) as `read_audio` would return them from a file of floats.

    Raises DataError for other types, shapes and rates, and if full scale is not ±1.
    """
    array = np.asarray(waveform)
    channels = len(settings.microphones)
    is_right_shape = array.ndim == 1 if channels == 1 else array.shape[:-1] == (channels,)
    if array.dtype.kind != "f" or not is_right_shape:
        shape = "(n,)" if channels == 1 else f"({channels}, n)"
        fix = f"give floats {shape}, with full scale ±1 (divide 16-bit integers by 32768)"
        raise DataError(HERE, f"samples are {array.dtype} of shape {array.shape}", fix)
    finite = array[np.isfinite(array)]
    peak = float(np.abs(finite).max(initial=0.0))
    if peak > MAX_PEAK:
        fix = "divide by full scale (32768 for 16-bit samples), so that full scale is ±1"
        raise DataError(HERE, f"the peak is {peak:.4g}, of a full scale of 1", fix)
    rate_hz = settings.sample_rate_hz
    if sample_rate_hz != rate_hz:
        problem = f"sampled at {sample_rate_hz:g} Hz, not {rate_hz} Hz"
        raise DataError(HERE, problem, f"resample it to {rate_hz} Hz")
    with np.errstate(over="ignore"):  # the checks refuse infinite samples
        samples = array.astype(np.float32)
    return Audio(
        samples,
        np.atleast_2d(samples).T,
        AudioInfo("", "FLOAT", rate_hz, channels, array.shape[-1]),
        (),
    )
