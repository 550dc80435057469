"""Settings of the audio files, features and targets of a data set."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from ajgdata.types.base import Distinct, Strict
from ajgdata.types.names import Name
from ajgdata.types.registry import Kind

#: Sample rates that a data set may have. A file with another rate has a damaged header.
LOWEST_RATE_HZ = 1_000
HIGHEST_RATE_HZ = 768_000


class FeatureSettings(Strict):
    """Settings of the feature, a spectrum that is summed over time.

    The paper specifies the window length (2048), the sum over time, and that spectra are
    normalised. We chose the hop, the window shape, the quantity and the norm.
    """

    kind: Literal["stft"] = Field("stft", description="short-time Fourier transform (paper)")
    window: int = Field(2048, ge=16, description="STFT window and FFT length in samples (paper)")
    hop: int = Field(512, ge=1, description="samples between windows (not specified in the paper)")
    window_shape: Literal["hann", "hamming", "blackman", "boxcar"] = Field(
        "hann", description="periodic window function (not specified in the paper)"
    )
    quantity: Literal["magnitude", "power", "root_power"] = Field(
        "magnitude",
        description="magnitude: sum of |X| over time; power: sum of |X|^2; root_power: square root "
        "of the sum of |X|^2 (not specified in the paper)",
    )
    normalisation: Literal["l1", "l2", "max", "none"] = Field(
        "l1", description="divisor of each spectrum: its norm (the paper writes only 'normalise')"
    )
    band_hz: tuple[float, float] | None = Field(
        None, description="bins from low to high frequency in Hz; null: all window/2 + 1 bins"
    )

    @model_validator(mode="after")
    def _ordered(self) -> FeatureSettings:
        if self.hop > self.window:
            raise ValueError(f"hop {self.hop} exceeds window {self.window}: samples would be lost")
        if self.band_hz and not 0 <= self.band_hz[0] < self.band_hz[1]:
            raise ValueError(f"band_hz {self.band_hz} must be 0 <= low < high")
        return self


def checked_microphone(value: Any) -> Any:
    """Return `value` if it is a microphone. Raises ValueError for every other value."""
    if value is None or value == "mean":
        return value
    if type(value) is int and value >= 1:  # isinstance would accept True
        return value
    raise ValueError("not a microphone: use its number, counted from 1, or mean")


#: Which channel of a file is used: the number of a microphone, counted from 1, or the mean of all
#: channels; None if files must have one channel.
Microphone = Annotated[int | Literal["mean"] | None, BeforeValidator(checked_microphone)]


class AudioSettings(Strict):
    """The format of the recordings, and the treatment of recordings with another format."""

    sample_rate_hz: int = Field(
        44_100, ge=LOWEST_RATE_HZ, le=HIGHEST_RATE_HZ, description="sample rate in Hz"
    )
    other_rate: Literal["reject", "resample"] = Field(
        "reject",
        description="treatment of a recording with another rate; reject: quarantine; resample: "
        "polyphase resampling",
    )
    microphone: Microphone = Field(
        None,
        description="channel of a file that is used: its number, counted from 1, or mean (of all "
        "channels); null: files must have one channel",
    )


class Target(Strict):
    """A column of labels that models can predict, or a vector of several columns of numbers."""

    kind: Kind = Field(description="regression: numbers; classification: texts")
    unit: str = Field("", description="unit of a regression target, e.g. mm; empty for classes")
    description: str = Field("", description="description of the target")
    missing: tuple[str, ...] = Field((), description="cell texts that mean 'not measured'")
    columns: Annotated[tuple[Name, ...], Distinct] = Field(
        (),
        description="label columns of a vector with one unit, e.g. [x_m, y_m]; default: the "
        "column with the name of the target",
    )

    @model_validator(mode="after")
    def _vector_of_numbers(self) -> Target:
        if self.columns and (self.kind != "regression" or len(self.columns) < 2):
            raise ValueError("columns: a vector is a regression with at least two columns")
        return self

    @property
    def axis(self) -> Target:
        """The target of one column of a vector."""
        return self.model_copy(update={"columns": ()})


class Level(Strict):
    """The value of a quantity that differs between data sets, e.g. of the noise outside.

    Figures with the results of several data sets use it as the numeric axis.
    """

    value: float = Field(description="value of the quantity")
    unit: str = Field("", description="unit of the value")
    quantity: str = Field(description="name of the quantity, e.g. sound level outside")
