"""Audio, features and targets of a data set as declared."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from ajgdata.types.base import Strict
from ajgdata.types.registry import Kind

#: Sample rates that can be declared; a file outside them has a damaged header.
LOWEST_RATE_HZ, HIGHEST_RATE_HZ = 1_000, 768_000


class FeatureSettings(Strict):
    """Signal -> spectrum. The paper gives the window (2048), the sum over time and *a*
    normalisation; window shape, hop, magnitude or power, and which norm are ours."""

    kind: Literal["stft"] = Field("stft", description="short-time Fourier transform (paper)")
    window: int = Field(2048, ge=16, description="STFT window and FFT length in samples (paper)")
    hop: int = Field(512, ge=1, description="samples between windows (the paper leaves it open)")
    window_shape: Literal["hann", "hamming", "blackman", "boxcar"] = Field(
        "hann", description="periodic window function (the paper leaves it open)"
    )
    quantity: Literal["magnitude", "power", "root_power"] = Field(
        "magnitude",
        description="|X| or |X|^2, summed over time, or the root of the latter (the paper leaves it"
        " open)",
    )
    normalisation: Literal["l1", "l2", "max", "none"] = Field(
        "l1", description="what each spectrum is divided by (the paper says only 'normalise')"
    )
    band_hz: tuple[float, float] | None = Field(
        None, description="keep bins with low <= f <= high; null keeps all window/2 + 1"
    )

    @model_validator(mode="after")
    def _ordered(self) -> FeatureSettings:
        if self.hop > self.window:
            raise ValueError(f"hop {self.hop} exceeds window {self.window}: samples would be lost")
        if self.band_hz and not 0 <= self.band_hz[0] < self.band_hz[1]:
            raise ValueError(f"band_hz {self.band_hz} must be 0 <= low < high")
        return self


def checked_microphone(value: Any) -> Any:
    """Return `value` if it names a microphone. Raises ValueError for every other value.

    Numbers are compared by type, because True equals 1.
    """
    if value is None or value == "mean" or (type(value) is int and value >= 1):
        return value
    raise ValueError("not a microphone: use its number, counted from 1, or mean")


#: Which channel of a file is used: the number of a microphone, counted from 1, or the mean of all
#: channels; None if files must have one channel.
Microphone = Annotated[int | Literal["mean"] | None, BeforeValidator(checked_microphone)]


class AudioSettings(Strict):
    """The format of a data set's recordings, and what may be done to those that differ."""

    sample_rate_hz: int = Field(
        44_100, ge=LOWEST_RATE_HZ, le=HIGHEST_RATE_HZ, description="declared rate"
    )
    other_rate: Literal["reject", "resample"] = Field(
        "reject", description="a recording at another rate is quarantined, or resampled (polyphase)"
    )
    microphone: Microphone = Field(
        None,
        description="which channel of a file is used: its number from 1, or mean (of all "
        "channels); null: files must have one channel",
    )


class Target(Strict):
    """One label column."""

    kind: Kind = Field(description="regression: numbers; classification: texts")
    unit: str = Field("", description="unit of a regression target, e.g. mm; empty for classes")
    description: str = Field("", description="what it is, for people")
    missing: tuple[str, ...] = Field((), description="cell texts that mean 'not measured'")


class Level(Strict):
    """A number in which data sets differ that one model is tested on."""

    value: float = Field(description="of the quantity")
    unit: str = Field("", description="of the value")
    quantity: str = Field(description="e.g. sound level outside")
