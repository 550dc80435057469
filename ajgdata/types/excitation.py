"""The played sound as it is declared: what kind of signal, how long, of which band and level.

`ajgdata.acquire.excitation` makes the samples; the same declaration drives a sound card and the
virtual gripper.
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


class _Played(Strict):
    """Base of every excitation: its length, level and edges."""

    length_s: float = Field(1.0, gt=0, le=60, description="of the sound")
    amplitude: float = Field(
        0.9, gt=0, le=1, description="peak, of full scale: 0.9 is -0.92 dBFS, 0.5 is -6 dBFS"
    )
    fade_s: float = Field(0.005, ge=0, description="raised-cosine fade at either end")
    silence_s: float = Field(
        0.0, ge=0, le=60, description="silence after it, recorded too: the sound dies away"
    )

    @property
    def description(self) -> str:
        """Return what it is, for people."""
        silence = f", then {self.silence_s:g} s of silence" if self.silence_s else ""
        fades = f", fades of {1e3 * self.fade_s:g} ms" if self.fade_s else ""
        head = f"{self._said()}, {self.length_s:g} s{fades}"
        return f"{head}, peak {20 * math.log10(self.amplitude):.2f} dBFS{silence}"

    def _said(self) -> str:
        raise NotImplementedError

    @model_serializer(mode="wrap")
    def _with_kind(self, serialize: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Write `kind` also if it is the default, because a reader chooses the model by it."""
        content: dict[str, Any] = serialize(self)
        content.setdefault("kind", getattr(self, "kind", ""))
        return content

    @model_validator(mode="after")
    def _fades_fit(self) -> _Played:
        if 2 * self.fade_s > self.length_s:
            raise ValueError(f"fade_s {self.fade_s:g}: two fades do not fit into length_s")
        return self


class LogSweep(_Played):
    """Sweep whose frequency grows by the same factor in equal times (Farina 2000; the paper's)."""

    kind: Literal["log_sweep"] = Field("log_sweep", description="what it is")
    low_hz: float = Field(20.0, gt=0, description="lowest frequency")
    high_hz: float = Field(20_000.0, gt=0, description="highest; below half the rate")

    def _said(self) -> str:
        return f"logarithmic sweep, {self.low_hz:g} to {self.high_hz:g} Hz"

    @model_validator(mode="after")
    def _ordered(self) -> LogSweep:
        if self.low_hz >= self.high_hz:
            raise ValueError(f"low_hz {self.low_hz:g} must be below high_hz {self.high_hz:g}")
        return self


class MaximumLengthSequence(_Played):
    """Binary noise of a shift register, white up to half the rate, repeated to fill its length."""

    kind: Literal["mls"] = Field("mls", description="what it is")
    fade_s: float = Field(0.0, ge=0, description="raised-cosine fade at either end")
    order: Annotated[int, Field(ge=2, le=20)] | None = Field(
        None, description="it repeats after 2^order - 1 samples; null: the longest that fits"
    )

    def _said(self) -> str:
        order = f" of order {self.order}" if self.order else ""
        return f"maximum-length sequence{order}"


ExcitationSpec = Annotated[LogSweep | MaximumLengthSequence, Field(discriminator="kind")]
#: The paper's: one second, logarithmic.
DEFAULT_EXCITATION = LogSweep()
