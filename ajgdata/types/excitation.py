"""Settings of the played sound: kind of signal, length, band and level; or of passive recording.

`ajgdata.acquire.excitation` computes the samples, for sound cards and for the virtual gripper.
"""

from __future__ import annotations

import math
from pathlib import PurePath
from typing import Annotated, Any, Literal

from pydantic import (
    Field,
    SerializerFunctionWrapHandler,
    field_validator,
    model_serializer,
    model_validator,
)

from ajgdata.types.base import Strict

#: Longest recording without a played sound, and longest time without a trigger, in seconds.
LONGEST_PASSIVE_S = 600
SilenceBefore = Annotated[
    float,
    Field(
        ge=0,
        le=60,
        description="silence before the sound in seconds, which is part of the recording; the "
        "latency is removed in any case",
    ),
]
SilenceAfter = Annotated[
    float,
    Field(
        ge=0,
        le=60,
        description="recorded silence after the sound in seconds, in which the response decays",
    ),
]


class _Kind(Strict):
    """Base class of the excitations: a stored excitation names its kind."""

    @model_serializer(mode="wrap")
    def _with_kind(self, serialize: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Write `kind` also if it is the default: readers choose the class by it.

        Older sessions have no `silence_before_s`. It is written only if there is such a silence, so
        that their settings are equal to the present ones.
        """
        content: dict[str, Any] = serialize(self)
        content.setdefault("kind", getattr(self, "kind", ""))
        if not content.get("silence_before_s"):
            content.pop("silence_before_s", None)
        return content


class _PlayedSound(_Kind):
    """Base class of the computed sounds: length, level, fades and silence."""

    length_s: float = Field(1.0, gt=0, le=60, description="length of the sound in seconds")
    amplitude: float = Field(
        0.9,
        gt=0,
        le=1,
        description="peak relative to full scale; 0.9 is -0.92 dBFS, 0.5 is -6 dBFS",
    )
    fade_s: float = Field(
        0.005, ge=0, description="length of the raised-cosine fade at each end in seconds"
    )
    silence_s: SilenceAfter = 0.0
    silence_before_s: SilenceBefore = 0.0

    @property
    def description(self) -> str:
        """Kind, length, fades, level and silence as text.

        >>> LogSweep().description
        'logarithmic sweep, 20 to 20000 Hz, 1 s, fades of 5 ms, peak -0.92 dBFS'
        """
        parts = [self._signal, f"{self.length_s:g} s"]
        if self.fade_s:
            parts.append(f"fades of {1e3 * self.fade_s:g} ms")
        parts.append(f"peak {20 * math.log10(self.amplitude):.2f} dBFS")
        return ", ".join([*parts, *_silences(self.silence_before_s, self.silence_s)])

    @property
    def _signal(self) -> str:
        """The kind of signal as text."""
        raise NotImplementedError

    @model_validator(mode="after")
    def _fades_fit(self) -> _PlayedSound:
        if 2 * self.fade_s > self.length_s:
            raise ValueError(f"fade_s {self.fade_s:g}: two fades do not fit into length_s")
        return self


class _Sweep(_PlayedSound):
    """Base class of the sweeps from a lowest to a highest frequency."""

    kind: str
    low_hz: float = Field(20.0, gt=0, description="lowest frequency in Hz")
    high_hz: float = Field(
        20_000.0, gt=0, description="highest frequency in Hz, below half the sample rate"
    )

    @model_validator(mode="after")
    def _ordered(self) -> _Sweep:
        if self.low_hz >= self.high_hz:
            raise ValueError(f"low_hz {self.low_hz:g} must be below high_hz {self.high_hz:g}")
        return self


class LogSweep(_Sweep):
    """Logarithmic sweep (paper): frequency rises by equal factors in equal times (Farina 2000)."""

    kind: Literal["log_sweep"] = Field("log_sweep", description="logarithmic sweep")

    @property
    def _signal(self) -> str:
        return f"logarithmic sweep, {self.low_hz:g} to {self.high_hz:g} Hz"


class LinearSweep(_Sweep):
    """Linear sweep (chirp): frequency rises by equal differences in equal times."""

    kind: Literal["linear_sweep"] = Field("linear_sweep", description="linear sweep")

    @property
    def _signal(self) -> str:
        return f"linear sweep, {self.low_hz:g} to {self.high_hz:g} Hz"


class MaximumLengthSequence(_PlayedSound):
    """Maximum-length sequence: periodic binary noise, white up to half the sample rate."""

    kind: Literal["mls"] = Field("mls", description="maximum-length sequence")
    fade_s: float = Field(
        0.0, ge=0, description="length of the raised-cosine fade at each end in seconds"
    )
    order: Annotated[int, Field(ge=2, le=20)] | None = Field(
        None,
        description="the period is 2^order - 1 samples; null: the longest period that fits into "
        "length_s",
    )

    @property
    def _signal(self) -> str:
        if self.order is None:
            return "maximum-length sequence"
        return f"maximum-length sequence of order {self.order}"


class WhiteNoise(_PlayedSound):
    """White noise: independent samples, which a seed determines, or a band of it."""

    kind: Literal["noise"] = Field("noise", description="white noise")
    seed: int = Field(0, ge=0, description="seed of the samples; equal seeds give equal sounds")
    low_hz: float = Field(0.0, ge=0, description="lowest frequency in Hz")
    high_hz: float | None = Field(
        None,
        gt=0,
        description="highest frequency in Hz, below half the sample rate; null: half the rate",
    )

    @property
    def _signal(self) -> str:
        name = f"white noise, seed {self.seed}"
        if self.high_hz is not None:
            return f"{name}, {self.low_hz:g} to {self.high_hz:g} Hz"
        return f"{name}, from {self.low_hz:g} Hz" if self.low_hz else name

    @model_validator(mode="after")
    def _ordered(self) -> WhiteNoise:
        if self.high_hz is not None and self.low_hz >= self.high_hz:
            raise ValueError(f"low_hz {self.low_hz:g} must be below high_hz {self.high_hz:g}")
        return self


class SoundFile(_Kind):
    """Own sound in a file with one channel and the sample rate of the data set."""

    kind: Literal["file"] = Field("file", description="sound in a file")
    file: str = Field(
        min_length=1, description="path of the file, relative to the folder of the project"
    )
    sha256: str = Field(
        "",
        pattern=r"^([0-9a-f]{64})?$",
        description="checksum of the file; default: that of the present file",
    )
    silence_s: SilenceAfter = 0.0
    silence_before_s: SilenceBefore = 0.0

    @field_validator("file")
    @classmethod
    def _inside_the_project(cls, file: str) -> str:
        path = PurePath(file)
        if path.anchor or ".." in path.parts:
            raise ValueError("must be a path inside the folder of the project")
        return file

    @property
    def description(self) -> str:
        """File, checksum and silence as text.

        >>> SoundFile(file="sounds/chirp.wav").description
        'file sounds/chirp.wav'
        """
        parts = [f"file {self.file}"]
        if self.sha256:
            parts.append(f"sha256 {self.sha256[:8]}…")
        return ", ".join([*parts, *_silences(self.silence_before_s, self.silence_s)])


class PassiveRecording(_Kind):
    """No played sound: the microphone records, at once or when a sound exceeds a level."""

    kind: Literal["none"] = Field("none", description="no played sound")
    length_s: float = Field(
        1.0, gt=0, le=LONGEST_PASSIVE_S, description="length of a recording in seconds"
    )
    trigger_dbfs: float | None = Field(
        None,
        le=0,
        description="peak level in dBFS at which a recording starts; null: it starts at once",
    )
    pre_trigger_s: float = Field(
        0.1, ge=0, description="part of length_s that is before the trigger, in seconds"
    )
    time_limit_s: float = Field(
        30.0,
        gt=0,
        le=LONGEST_PASSIVE_S,
        description="seconds without a trigger after which a recording has failed",
    )

    @property
    def description(self) -> str:
        """Length and trigger as text.

        >>> PassiveRecording(trigger_dbfs=-30).description
        'no played sound, 1 s from 0.1 s before a peak of -30 dBFS'
        """
        text = f"no played sound, {self.length_s:g} s"
        if self.trigger_dbfs is None:
            return text
        return f"{text} from {self.pre_trigger_s:g} s before a peak of {self.trigger_dbfs:g} dBFS"

    @property
    def waiting_text(self) -> str:
        """Text for a person who waits until the recording starts.

        >>> PassiveRecording(trigger_dbfs=-30).waiting_text
        'recording starts at -30 dBFS; waiting up to 30 s'
        """
        if self.trigger_dbfs is None:
            return f"recording {self.length_s:g} s"
        return (
            f"recording starts at {self.trigger_dbfs:g} dBFS; waiting up to {self.time_limit_s:g} s"
        )

    @model_validator(mode="after")
    def _contains_the_trigger(self) -> PassiveRecording:
        if self.trigger_dbfs is not None and self.pre_trigger_s >= self.length_s:
            raise ValueError(
                f"pre_trigger_s {self.pre_trigger_s:g} must be below length_s {self.length_s:g}"
            )
        return self


def _silences(before_s: float, after_s: float) -> list[str]:
    """Return the silence before and after a sound as text."""
    parts = []
    if before_s:
        parts.append(f"after {before_s:g} s of silence")
    if after_s:
        parts.append(f"then {after_s:g} s of silence")
    return parts


ExcitationSpec = Annotated[
    LogSweep | LinearSweep | MaximumLengthSequence | WhiteNoise | SoundFile | PassiveRecording,
    Field(discriminator="kind"),
]
#: The sound of the paper: a logarithmic sweep of one second.
DEFAULT_EXCITATION = LogSweep()
