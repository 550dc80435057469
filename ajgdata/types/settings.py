"""Settings of the audio files and targets of a data set."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from ajgdata.types.base import Distinct, Strict
from ajgdata.types.names import Name
from ajgdata.types.registry import Kind

#: Sample rates that a data set may have. A file with another rate has a damaged header.
LOWEST_RATE_HZ = 1_000
HIGHEST_RATE_HZ = 768_000


def checked_microphone(value: Any) -> Any:
    """Return `value` if it is a microphone. Raises ValueError for every other value."""
    if value is None or value == "mean":
        return value
    if _is_number(value):
        return value
    is_list = isinstance(value, (list, tuple)) and all(map(_is_number, value))
    if is_list and len(value) > 1 and len(set(value)) == len(value):
        return value
    raise ValueError("not a microphone: use its number, counted from 1, a list of numbers, or mean")


def _is_number(value: Any) -> bool:
    """Return whether a value is the number of a microphone."""
    return type(value) is int and value >= 1  # isinstance would accept True


#: Which channels of a file are used: the number of a microphone, counted from 1, several numbers,
#: or the mean of all channels; None if files must have one channel.
Microphone = Annotated[
    int | tuple[int, ...] | Literal["mean"] | None, BeforeValidator(checked_microphone)
]


def numbers_of(microphone: Microphone) -> tuple[int, ...]:
    """Return the numbers of the used microphones; none for the mean and for files with one channel.

    >>> numbers_of(2), numbers_of((1, 3)), numbers_of("mean")
    ((2,), (1, 3), ())
    """
    if isinstance(microphone, tuple):
        return microphone
    return (microphone,) if isinstance(microphone, int) else ()


def as_written(microphone: Microphone) -> object:
    """Return a microphone as dataset.yaml writes it: a tuple is a list."""
    return list(microphone) if isinstance(microphone, tuple) else microphone


def microphone_text(microphone: Microphone) -> str:
    """Return the used channels in words.

    >>> microphone_text(2), microphone_text((1, 3)), microphone_text("mean")
    ('microphone 2', 'microphones 1 and 3', 'the mean')
    """
    numbers = [str(number) for number in numbers_of(microphone)]
    if not numbers:
        return "the mean" if microphone == "mean" else "one channel"
    if len(numbers) == 1:
        return f"microphone {numbers[0]}"
    return f"microphones {', '.join(numbers[:-1])} and {numbers[-1]}"


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
        description="channel of a file that is used: its number, counted from 1, a list of "
        "numbers, or mean (of all channels); null: files must have one channel",
    )

    @property
    def microphones(self) -> tuple[int, ...]:
        """The numbers of the used microphones; (1,) for the mean, which is one sound."""
        return numbers_of(self.microphone) or (1,)


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
