"""A sound card as an acquisition sees it: settings, takes, and what may go wrong.

The driver is behind a line (acquire.line: PortAudio in a process of its own); a `Card`
(acquire.sound_card) decides by the sound that came back.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationError

from ajgdata.types import DataError
from ajgdata.types.base import Strict, describe

#: Device of sessions that the virtual gripper recorded: they are simulated.
DEVICE = "virtual gripper"


class CardError(DataError):
    """The sound card cannot go on: nothing more is recorded before somebody mends it."""


class TakeError(CardError):
    """No take of several was beyond doubt; the next may be."""


class CardSettings(Strict):
    """Which device plays and records, and on which of its channels, counted from 1."""

    device: str = Field(min_length=1, description="exact name, as `ajgdata device list` has it")
    sample_rate_hz: int = Field(44_100, gt=0)
    output_channel: int = Field(1, ge=1)
    input_channel: int = Field(1, ge=1)
    loopback_channel: int | None = Field(
        None,
        ge=1,
        description="input that a cable connects to the output: latency is then exact in each take;"
        " null: measured by the microphone, once a session",
    )
    attempts: int = Field(3, ge=1, le=20, description="takes in doubt before it is given up")


def card_settings(**keys: Any) -> CardSettings:
    """Return the settings that a person gave. Raises DataError, in one line, for one that cannot
    be."""
    try:
        return CardSettings(**keys)
    except ValidationError as error:
        raise describe(error, "sound card") from None


class Heard(NamedTuple):
    """Recording of a line: `samples` float32 (frames, channels), and the reports of the driver."""

    samples: NDArray[np.float32]
    flags: tuple[str, ...] = ()


@dataclass(frozen=True)
class Capture:
    """One take beyond doubt.

    `samples` float32 (n + tail,) in [-1, 1], without the `latency_samples` that were taken out;
    `arrival_samples` is when the microphone heard it, measured in this take (None for a silence,
    both). `clipped` counts samples at full scale, `xruns` the reports
    of the driver. `doubts` says why each earlier attempt was thrown away.
    """

    samples: NDArray[np.float32]
    latency_samples: int | None
    arrival_samples: int | None
    peak_dbfs: float
    clipped: int
    xruns: int
    time: str
    doubts: tuple[str, ...] = ()

    @property
    def attempts(self) -> int:
        """Takes that it took."""
        return len(self.doubts) + 1

    def labels(self) -> dict[str, str]:
        """Return what is kept of it in recordings.csv, as text by column."""
        delays = {
            "latency_samples": self.latency_samples,
            "arrival_samples": self.arrival_samples,
        }
        return {
            **{name: "" if value is None else str(value) for name, value in delays.items()},
            "peak_dbfs": f"{self.peak_dbfs:.2f}",
            "clipped": str(self.clipped),
            "xruns": str(self.xruns),
            "attempts": str(self.attempts),
            "time": self.time,
        }


class Card(Protocol):
    """A speaker and a microphone on one sound card, for one session."""

    @property
    def settings(self) -> CardSettings:
        """Device, rate and channels: the same for the whole session."""
        ...

    def resume(self, latency_samples: int | None) -> None:
        """Go on with a session whose latency is known: takes are cut alike before and after."""
        ...

    def take(self, played: NDArray[np.float32], tail: int = 0) -> Capture:
        """Play (n,) once and return n + tail samples. Raises TakeError, or CardError for good."""
        ...

    def listen(self, frames: int) -> Capture:
        """Play nothing and return `frames` samples. Raises as `take` does."""
        ...

    def describe(self) -> Mapping[str, Any]:
        """Return device, driver, channels and latency, as session.yaml keeps them."""
        ...

    def close(self) -> None:
        """Let the card go. May be called twice."""
        ...
