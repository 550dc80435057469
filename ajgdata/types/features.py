"""Settings of the feature: what a model receives of a recording.

Each kind of feature has a class of settings, which names the function that computes it. Installed
packages add kinds by entry points (docs/examples/own_feature_package).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self, get_args

from pydantic import (
    Field,
    PlainValidator,
    SerializeAsAny,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)

from ajgdata.types.base import Distinct, Strict
from ajgdata.types.registry import Registry
from ajgdata.types.settings import AudioSettings, numbers_of

#: Lowest and highest frequency in Hz for a feature that has all bins.
ALL_HZ = (-math.inf, math.inf)
#: Kind of a mapping of settings that names none.
_SPECTRUM = "spectrum"
#: A band in Hz, from low to high frequency.
Band = tuple[float, float]


class FeatureKind(Strict):
    """Base class of the settings of a kind of feature.

    `function` is `module:function` of `compute(samples, sample_rate_hz, played, settings)`, which
    `ajgdata.features.compute` describes.
    """

    function: ClassVar[str]
    kind: str = Field(description="kind of feature")

    @property
    def needs_played(self) -> bool:
        """Whether the feature also depends on the sound that the session played."""
        return False

    @property
    def table_columns(self) -> tuple[str, ...]:
        """The columns of an imported table that are the feature; none for all other features."""
        return ()

    @property
    def needs_waveform(self) -> bool:
        """Whether the feature is computed from samples; else a row of an imported table has it."""
        return not self.table_columns

    @property
    def files(self) -> dict[str, str]:
        """The sha256 of each file that the feature needs, by its path relative to dataset.yaml."""
        return {}

    @property
    def is_power(self) -> bool:
        """Whether the values are powers; the level of other values is that of amplitudes."""
        return False

    @model_serializer(mode="wrap")
    def _with_kind(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        # A mapping without a kind is a spectrum: files without defaults need all other kinds.
        content: dict[str, Any] = handler(self)
        return content if self.kind == _SPECTRUM else {"kind": self.kind, **content}

    def least_samples(self, sample_rate_hz: float) -> int:
        """Return the least number of samples of a recording that has this feature."""
        return 1

    def reaching_hz(self, sample_rate_hz: float) -> Band:
        """Return the lowest and highest frequency in Hz of lines that change the feature.

        An offset is a line at 0 Hz. The checks of recordings ignore defects at other frequencies.
        """
        return ALL_HZ

    def check(self, audio: AudioSettings) -> None:
        """Raise ValueError if recordings with these settings cannot have the feature."""

    def in_folder(self, folder: Path) -> Self:
        """Return the settings with absolute paths; `folder` is that of dataset.yaml."""
        return self


def reaching_hz(band_hz: Band | None, window: int, sample_rate_hz: float) -> Band:
    """Return the lowest and highest frequency in Hz of lines that reach a bin of `band_hz`.

    A line also reaches the neighbours of its bin, because the main lobe of the Hann window of
    `window` samples has a width of four bins.
    """
    if band_hz is None:
        return ALL_HZ
    bin_hz = sample_rate_hz / window
    lowest, highest = band_hz
    return lowest - bin_hz, highest + bin_hz


Shape = Literal["hann", "hamming", "blackman", "boxcar"]
Norm = Literal["l1", "l2", "max", "none"]


class ShortTime(FeatureKind):
    """Base class of features from short-time Fourier transforms."""

    window: int = Field(2048, ge=16, description="STFT window and FFT length in samples")
    hop: int = Field(512, ge=1, description="samples between windows")
    window_shape: Shape = Field("hann", description="periodic window function")
    band_hz: Band | None = Field(
        None, description="bins from low to high frequency in Hz; null: all window/2 + 1 bins"
    )

    def least_samples(self, sample_rate_hz: float) -> int:
        """Return the length of one window."""
        return self.window

    def reaching_hz(self, sample_rate_hz: float) -> Band:
        """Return the frequencies of `band_hz` and of the neighbours of its bins."""
        return reaching_hz(self.band_hz, self.window, sample_rate_hz)

    def check(self, audio: AudioSettings) -> None:
        """Raise ValueError if `band_hz` contains no bin."""
        if self.band_hz is None:
            return
        bins_per_hz = self.window / audio.sample_rate_hz
        first = math.ceil(self.band_hz[0] * bins_per_hz)
        last = min(math.floor(self.band_hz[1] * bins_per_hz), self.window // 2)
        if first > last:
            raise ValueError(f"features.band_hz {self.band_hz} holds no bin")

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.hop > self.window:
            raise ValueError(f"hop {self.hop} exceeds window {self.window}: samples would be lost")
        if self.band_hz and not 0 <= self.band_hz[0] < self.band_hz[1]:
            raise ValueError(f"band_hz {self.band_hz} must be 0 <= low < high")
        return self


class FeatureSettings(ShortTime):
    """Settings of the feature `spectrum`: a spectrum that is summed over time.

    The paper specifies the window length (2048), the sum over time, and that spectra are
    normalised. We chose the hop, the window shape, the quantity and the norm.
    """

    function = "ajgdata.features.spectrum:spectra"
    kind: Literal["spectrum"] = Field(
        "spectrum", description="short-time Fourier transform, summed over time (paper)"
    )
    window: int = Field(2048, ge=16, description="STFT window and FFT length in samples (paper)")
    hop: int = Field(512, ge=1, description="samples between windows (not specified in the paper)")
    window_shape: Shape = Field(
        "hann", description="periodic window function (not specified in the paper)"
    )
    quantity: Literal["magnitude", "power", "root_power"] = Field(
        "magnitude",
        description="magnitude: sum of |X| over time; power: sum of |X|^2; root_power: square root "
        "of the sum of |X|^2 (not specified in the paper)",
    )
    normalisation: Norm = Field(
        "l1", description="divisor of each spectrum: its norm (the paper writes only 'normalise')"
    )

    @property
    def is_power(self) -> bool:
        """Whether the quantity is a power."""
        return self.quantity == "power"


class SpectrogramSettings(ShortTime):
    """Settings of the feature `spectrogram`: the transform without a sum over time."""

    function = "ajgdata.features.spectrogram:spectrograms"
    kind: Literal["spectrogram"] = Field(
        "spectrogram", description="short-time Fourier transform (time, frequency)"
    )
    window: int = Field(1024, ge=16, description="STFT window and FFT length in samples")
    length_s: float = Field(
        1.0,
        gt=0,
        description="used seconds at the beginning of a recording; shorter recordings are "
        "quarantined",
    )
    quantity: Literal["magnitude", "power"] = Field("magnitude", description="|X| or |X|^2")
    normalisation: Norm = Field("l1", description="divisor of all values of a microphone: a norm")

    @property
    def is_power(self) -> bool:
        """Whether the quantity is a power."""
        return self.quantity == "power"

    def least_samples(self, sample_rate_hz: float) -> int:
        """Return the number of samples in `length_s`, or at least one window."""
        return max(self.window, round(self.length_s * sample_rate_hz))


class MelSettings(ShortTime):
    """Settings of the feature `mel`: levels in bands of equal width on the mel scale."""

    function = "ajgdata.features.mel:mel_levels"
    kind: Literal["mel"] = Field("mel", description="levels in mel bands, or cepstra of them")
    bands: int = Field(64, ge=1, description="number of bands between the limits of band_hz")
    scale: Literal["htk", "slaney"] = Field(
        "htk",
        description="htk: mel = 2595 log10(1 + f/700); slaney: linear below 1 kHz, logarithmic "
        "above",
    )
    over_time: Literal["mean", "frames"] = Field(
        "mean", description="mean: levels of the mean power; frames: levels of each window"
    )
    length_s: float = Field(
        1.0,
        gt=0,
        description="with `frames`: used seconds at the beginning of a recording; shorter "
        "recordings are quarantined",
    )
    floor_db: float = Field(
        -80.0, lt=0, description="lowest level in dB, relative to the highest of the recording"
    )
    normalisation: Literal["max", "none"] = Field(
        "max", description="max: levels relative to the highest one; none: 10 log10 of the power"
    )
    cepstra: int | None = Field(
        None,
        ge=1,
        description="number of mel-frequency cepstral coefficients (MFCC), from 0; null: levels",
    )

    def least_samples(self, sample_rate_hz: float) -> int:
        """Return the length of one window; with frames, the number of samples in `length_s`."""
        if self.over_time == "mean":
            return self.window
        return max(self.window, round(self.length_s * sample_rate_hz))

    @model_validator(mode="after")
    def _enough_bands(self) -> MelSettings:
        if self.cepstra is not None and self.cepstra > self.bands:
            raise ValueError(f"cepstra {self.cepstra} exceed bands {self.bands}")
        return self


#: Least number of windows of an estimate of the coherence, which is at most their inverse for
#: sounds that are independent of each other.
COHERENCE_WINDOWS = 8


class TransferFunctionSettings(ShortTime):
    """Settings of the feature `transfer_function`: the magnitude of the H1 estimate.

    H1 = S_xy / S_xx, with the spectra of Welch's method of the reference x and a microphone y.
    """

    function = "ajgdata.features.transfer_function:transfer_functions"
    kind: Literal["transfer_function"] = Field(
        "transfer_function", description="magnitude of the H1 estimate"
    )
    reference: Literal["played"] | Annotated[int, Field(ge=1)] = Field(
        "played", description="played: the played sound of the session; or a microphone's number"
    )
    least_coherence: float = Field(
        0.5,
        ge=0,
        lt=1,
        description="bins with a lower coherence are 0; a recording with such bins in more than "
        "half of the band has a warning, one without other bins is quarantined",
    )
    normalisation: Norm = Field("none", description="divisor of each transfer function: its norm")

    @property
    def needs_played(self) -> bool:
        """Whether the reference is the played sound."""
        return self.reference == "played"

    def least_samples(self, sample_rate_hz: float) -> int:
        """Return the length of the windows that an estimate of the coherence requires."""
        return self.window + (COHERENCE_WINDOWS - 1) * self.hop

    def check(self, audio: AudioSettings) -> None:
        """Raise ValueError if the reference is not one of several microphones."""
        super().check(audio)
        numbers = numbers_of(audio.microphone)
        if not self.needs_played and (len(numbers) < 2 or self.reference not in numbers):
            raise ValueError(
                f"features.reference {self.reference} is not one of several numbers in "
                "audio.microphone"
            )


class EmbeddingSettings(FeatureKind):
    """Settings of the feature `embedding`: the output of a network in a local ONNX file.

    Its first input gets float32 samples (channels, n), its first output is a vector.
    """

    function = "ajgdata.features.embedding:embeddings"
    kind: Literal["embedding"] = Field("embedding", description="output of a network")
    file: str = Field(min_length=1, description="ONNX file, relative to the folder of dataset.yaml")
    sha256: str = Field(
        pattern=r"^[0-9a-f]{64}$", description="checksum of the file (`sha256sum FILE`)"
    )
    sample_rate_hz: int | None = Field(
        None, ge=1, description="rate of the network, to which samples are resampled; null: equal"
    )
    length_s: float = Field(
        1.0,
        gt=0,
        description="used seconds at the beginning of a recording; shorter recordings are "
        "quarantined",
    )

    def least_samples(self, sample_rate_hz: float) -> int:
        """Return the number of samples in `length_s`."""
        return max(1, round(self.length_s * sample_rate_hz))

    @property
    def files(self) -> dict[str, str]:
        """The sha256 of the network, by its path relative to dataset.yaml."""
        return {self.file: self.sha256}

    def in_folder(self, folder: Path) -> Self:
        """Return the settings with the absolute path of the file."""
        return self.model_copy(update={"file": str(folder.absolute() / self.file)})


class TableSettings(FeatureKind):
    """Settings of the feature `table`: columns of numbers of an imported table.

    The recordings have no waveform.
    """

    function = "ajgdata.features.table:row_values"
    kind: Literal["table"] = Field("table", description="columns of an imported table")
    columns: Annotated[tuple[Annotated[str, Field(min_length=1)], ...], Distinct] = Field(
        min_length=1, description="names of the columns, which are the values of the feature"
    )

    @property
    def table_columns(self) -> tuple[str, ...]:
        """The columns of the setting."""
        return self.columns


_AnyShipped = (
    FeatureSettings
    | SpectrogramSettings
    | MelSettings
    | TransferFunctionSettings
    | EmbeddingSettings
    | TableSettings
)
#: Kinds of features of this package.
SHIPPED: tuple[type[FeatureKind], ...] = get_args(_AnyShipped)
#: Entry points of features in other packages: name of the kind, and `module:class` of its settings.
#: A module is imported when a data set has its kind.
OWN_FEATURES = entry_points(group="ajgdata.features")
FEATURES: Registry[type[FeatureKind] | EntryPoint] = Registry(
    "kind of feature", {model.model_fields["kind"].default: model for model in SHIPPED}
)
for _point in OWN_FEATURES:
    FEATURES.add(_point.name, _point, _point)
#: Name of the kind `spectrum` in files of version 0.2.0 and earlier.
_FORMER_SPECTRUM = "stft"


def feature_class(kind: str) -> type[FeatureKind]:
    """Return the class of the settings of a kind of feature.

    Raises ValueError for an unknown kind, and for an entry point that is no such class.
    """
    entry = FEATURES[kind]
    if not isinstance(entry, EntryPoint):
        return entry
    own = entry.load()
    if not (isinstance(own, type) and issubclass(own, FeatureKind)):
        raise ValueError(f"{entry.value} is not a subclass of ajgdata.FeatureKind")
    return own


def feature_settings(content: Any) -> FeatureKind:
    """Return the settings of a feature; `content` is a mapping, or such settings.

    A mapping without `kind` is a spectrum. Raises ValueError, or ValidationError (a ValueError)
    with the wrong keys, for all other content.
    """
    if isinstance(content, FeatureKind):
        return content
    if not isinstance(content, Mapping):
        raise ValueError("write a mapping, e.g. `features: {kind: spectrum}`")
    kind = content.get("kind", _SPECTRUM)
    if kind == _FORMER_SPECTRUM:
        kind = _SPECTRUM
    return feature_class(str(kind)).model_validate({**content, "kind": kind})


#: The settings of any kind of feature, as a field of settings or a parameter of a job.
AnyFeature = Annotated[
    SerializeAsAny[FeatureKind],
    PlainValidator(feature_settings, json_schema_input_type=_AnyShipped),
]
