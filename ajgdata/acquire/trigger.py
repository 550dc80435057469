"""Trigger of a passive recording: the first sample whose magnitude reaches a level."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.types import PassiveRecording


class Trigger(NamedTuple):
    """Start and length of a passive recording, in frames.

    `level` is the magnitude that starts the recording, relative to full scale; 0 starts it at once.
    The recording has `frames`, of which `before` are before the trigger. The trigger is searched in
    `limit` frames, after the first `before`.
    """

    level: float
    frames: int
    before: int
    limit: int

    @classmethod
    def from_settings(cls, settings: PassiveRecording, sample_rate_hz: int) -> Trigger:
        """Return the trigger of `settings` at a sample rate."""
        frames = round(settings.length_s * sample_rate_hz)
        if settings.trigger_dbfs is None:
            return cls(0.0, frames, before=0, limit=1)
        return cls(
            level=float(10 ** (settings.trigger_dbfs / 20)),
            frames=frames,
            before=round(settings.pre_trigger_s * sample_rate_hz),
            limit=round(settings.time_limit_s * sample_rate_hz),
        )

    @property
    def longest(self) -> int:
        """Number of frames after which the recording is complete, or has failed."""
        return self.limit + self.frames

    def start(self, samples: NDArray[np.float32], end: int, searched: int = 0) -> int | None:
        """Return the index at which the recording begins; None without a trigger.

        `samples` (m,) are those since the microphone is on, of which `end` are recorded. The first
        `searched` of them have no trigger.
        """
        first = max(self.before, searched)
        last = min(end, self.before + self.limit)
        reaches = ~(np.abs(samples[first:last]) < self.level)  # also samples that are not numbers
        if not reaches.any():
            return None
        return first + int(np.argmax(reaches)) - self.before
