"""Settings of the played sound: kind of signal, length, band and level.

`ajgdata.acquire.excitation` computes the samples, for sound cards and for the virtual gripper.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import (
    Field,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)

from ajgdata.types.base import Strict


class _PlayedSound(Strict):
    """Base class of the excitations: length, level and fades."""

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
    silence_s: float = Field(
        0.0,
        ge=0,
        le=60,
        description="recorded silence after the sound in seconds, in which the response decays",
    )

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
        if self.silence_s:
            parts.append(f"then {self.silence_s:g} s of silence")
        return ", ".join(parts)

    @property
    def _signal(self) -> str:
        """The kind of signal as text."""
        raise NotImplementedError

    @model_serializer(mode="wrap")
    def _with_kind(self, serialize: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Write `kind` also if it is the default: readers choose the class by it."""
        content: dict[str, Any] = serialize(self)
        content.setdefault("kind", getattr(self, "kind", ""))
        return content

    @model_validator(mode="after")
    def _fades_fit(self) -> _PlayedSound:
        if 2 * self.fade_s > self.length_s:
            raise ValueError(f"fade_s {self.fade_s:g}: two fades do not fit into length_s")
        return self


class LogSweep(_PlayedSound):
    """Logarithmic sweep (paper): frequency rises by equal factors in equal times (Farina 2000)."""

    kind: Literal["log_sweep"] = Field("log_sweep", description="logarithmic sweep")
    low_hz: float = Field(20.0, gt=0, description="lowest frequency in Hz")
    high_hz: float = Field(
        20_000.0, gt=0, description="highest frequency in Hz, below half the sample rate"
    )

    @property
    def _signal(self) -> str:
        return f"logarithmic sweep, {self.low_hz:g} to {self.high_hz:g} Hz"

    @model_validator(mode="after")
    def _ordered(self) -> LogSweep:
        if self.low_hz >= self.high_hz:
            raise ValueError(f"low_hz {self.low_hz:g} must be below high_hz {self.high_hz:g}")
        return self


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


ExcitationSpec = Annotated[LogSweep | MaximumLengthSequence, Field(discriminator="kind")]
#: The sound of the paper: a logarithmic sweep of one second.
DEFAULT_EXCITATION = LogSweep()
