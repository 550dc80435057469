"""Settings, recordings and errors of a sound card, real or simulated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ajgdata.types import DataError, PassiveRecording
from ajgdata.types.base import Strict

#: Device of sessions that the virtual gripper recorded: they are simulated.
DEVICE = "virtual gripper"
#: Full scale of a 16-bit converter, the smallest in use.
FULL_SCALE = 1 - 2.0**-15
#: What a card plays during a take: samples float32 (n,) in [-1, 1], or no sound.
Sound = NDArray[np.float32] | PassiveRecording


class CardError(DataError):
    """A fault of the sound card that a person must repair."""


class TakeError(CardError):
    """Each attempt at a take had a fault. A further take may be good."""


class CardSettings(Strict):
    """The device that plays and records, with its channels, which are counted from 1."""

    device: str = Field(min_length=1, description="exact name, as `ajgdata device list` has it")
    sample_rate_hz: int = Field(44_100, gt=0)
    output_channel: int = Field(1, ge=1, strict=True)
    microphone: int = Field(1, ge=1, strict=True)
    attempts: int = Field(3, ge=1, le=20, description="takes with a fault before it gives up")


@dataclass(frozen=True)
class Capture:
    """One take without a fault.

    `samples` float32 (n + tail,) in [-1, 1] begin after `latency_samples`, the latency of the
    session. `arrival_samples` is the delay at the microphone, measured in this take. Both are None
    without a played sound. `clipped` is the number of samples at full scale, `xruns` the number of
    reports of the driver. `doubts` are the faults of earlier attempts.
    """

    samples: NDArray[np.float32]
    latency_samples: int | None
    arrival_samples: int | None
    peak_dbfs: float
    clipped: int
    xruns: int
    time: str
    doubts: tuple[str, ...] = ()

    @classmethod
    def measured(
        cls, samples: NDArray[np.float32], full_scale: float = 1.0, **about: Any
    ) -> Capture:
        """Return a take of samples (n,) with its peak and its number of clipped samples.

        `about` are further fields; `clipped` replaces the number of samples at `full_scale`.
        """
        peak = float(np.abs(samples).max())
        facts = {"clipped": int(np.count_nonzero(np.abs(samples) >= full_scale))} | about
        return cls(
            np.clip(samples, -1.0, 1.0), peak_dbfs=20 * float(np.log10(max(peak, 1e-10))), **facts
        )

    @property
    def attempts(self) -> int:
        """Number of takes until this one."""
        return len(self.doubts) + 1

    def labels(self) -> dict[str, str]:
        """Return the cells of the take in recordings.csv by column."""
        names = ("latency_samples", "arrival_samples", "clipped", "xruns", "attempts", "time")
        values = {name: getattr(self, name) for name in names}
        cells = {name: "" if value is None else str(value) for name, value in values.items()}
        return {**cells, "peak_dbfs": f"{self.peak_dbfs:.2f}"}
