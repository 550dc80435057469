"""Settings of the changed copies of recordings that models are trained on (`augment` of a task)."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from ajgdata.types.base import Strict
from ajgdata.types.names import Name

#: Noise that is computed; any other source of noise is the name of a data set.
COMPUTED_NOISE = ("white", "pink")


def _ordered(values: tuple[float, float]) -> tuple[float, float]:
    """Return a range. Raises ValueError if its low end is above its high end."""
    low, high = values
    if low > high:
        raise ValueError(f"[{low:g}, {high:g}] is not a range: write the low end first")
    return values


#: Low and high end; the value of each copy is drawn uniformly between them.
Range = Annotated[tuple[float, float], AfterValidator(_ordered)]


class AddedNoise(Strict):
    """Noise that is added to a copy of a recording."""

    source: Literal["white", "pink"] | Name = Field(
        "white",
        description="white or pink noise, or the name of a data set whose recordings are the "
        "noise, e.g. esc10; other sample rates are resampled",
    )
    snr_db: Range | None = Field(
        None,
        description="range of the signal-to-noise ratio in dB: mean power of the recording over "
        "that of the noise; give either snr_db or level_dbfs",
    )
    level_dbfs: Range | None = Field(
        None, description="range of the RMS of the noise in dB of full scale"
    )

    @model_validator(mode="after")
    def _one_level(self) -> AddedNoise:
        if (self.snr_db is None) == (self.level_dbfs is None):
            raise ValueError("give either snr_db or level_dbfs, for example snr_db: [0, 20]")
        return self


class Augment(Strict):
    """Changed copies of the recordings of each training part. No copy is tested.

    Each copy is shifted, then noise is added, then the gain is applied. The values are drawn for
    each copy from the seed of the run and the name of the recording.
    """

    copies: int = Field(
        1, ge=1, le=100, description="number of copies of each recording, in addition to itself"
    )
    noise: AddedNoise | None = Field(None, description="added noise; null: none")
    gain_db: Range | None = Field(
        None,
        description="range of the gain in dB; the default feature is normalised and does not "
        "change; null: none",
    )
    shift_ms: Range | None = Field(
        None,
        description="range of the shift in ms; above 0: later; zeros replace the missing samples; "
        "null: none",
    )

    @model_validator(mode="after")
    def _changes_something(self) -> Augment:
        if self.noise is None and self.gain_db is None and self.shift_ms is None:
            raise ValueError("nothing changes: give noise, gain_db or shift_ms")
        return self

    @property
    def noise_set(self) -> str:
        """Return the data set whose recordings are the noise, or "" for other noise."""
        if self.noise is None or self.noise.source in COMPUTED_NOISE:
            return ""
        return self.noise.source

    @property
    def text(self) -> str:
        """Return the copies in words, for the report."""
        changes = []
        if self.shift_ms is not None:
            changes.append(f"a shift of {_text(self.shift_ms)} ms")
        if self.noise is not None:
            source = f"recordings of {self.noise_set} as" if self.noise_set else self.noise.source
            if self.noise.snr_db is not None:
                level = f"{_text(self.noise.snr_db)} dB below the recording"
            else:
                assert self.noise.level_dbfs is not None, "the other way to state the level"
                level = f"{_text(self.noise.level_dbfs)} dB of full scale"
            changes.append(f"{source} noise at {level}")
        if self.gain_db is not None:
            changes.append(f"a gain of {_text(self.gain_db)} dB")
        noun = "copy" if self.copies == 1 else "copies"
        return f"{self.copies} {noun} of each recording with {', '.join(changes)}"


def _text(values: tuple[float, float]) -> str:
    """Return a range in words."""
    low, high = values
    return f"{low:g} to {high:g}"
