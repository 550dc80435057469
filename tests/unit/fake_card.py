"""A sound card in this process: a known plant between output and input, and faults on demand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.signal import fftconvolve

from ajgdata.acquire.card import CardError, CardSettings
from ajgdata.acquire.sound_card import SoundCard
from ajgdata.acquire.trigger import Trigger

RATE_HZ = 44_100


@dataclass
class Fault:
    """What goes wrong in one take; `at` is the frame where, counted from the first one played."""

    delete: int = 0  #: frames that are lost
    insert: int = 0  #: frames that are played twice
    at: int = 20_000
    flags: tuple[str, ...] = ()
    gain: float = 1.0
    silent: bool = False
    nan: bool = False
    shift: int = 0  #: samples by which the latency is another
    unplugged: bool = False


@dataclass
class FakeLine:
    """Line (see acquire.line) through `response`, after `latency` samples. `faults` are used one a
    take; then none. `room` (m,) is recorded from the moment at which the line listens."""

    response: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.5, -0.25]))
    latency: int = 1_024
    noise: float = 0.0
    faults: Sequence[Fault] = ()
    room: np.ndarray = field(default_factory=lambda: np.zeros(0))
    takes: int = 0
    closed: bool = False

    def play(self, sound: np.ndarray, frames: int) -> tuple[np.ndarray, tuple[str, ...]]:
        assert sound.dtype == np.float32 and sound.ndim == 1 and not self.closed
        fault = self.faults[self.takes] if self.takes < len(self.faults) else Fault()
        self.takes += 1
        if fault.unplugged:
            raise CardError("fake", "went away while it played", "plug it in again")
        out = np.zeros(frames)
        late = self.latency + fault.shift
        echo = fftconvolve(sound, self.response)[: frames - late] * fault.gain
        if not fault.silent:
            out[late : late + len(echo)] = echo
        cut = fault.at + late
        if fault.delete:
            out = np.concatenate([out[:cut], out[cut + fault.delete :], out[: fault.delete] * 0])
        if fault.insert:
            out = np.concatenate([out[:cut], out[cut - fault.insert :]])[:frames]
        noise = np.random.default_rng(self.takes).standard_normal(out.shape)
        out = out + self.noise * noise
        if fault.nan:
            out[cut] = np.nan
        return out.astype(np.float32), fault.flags

    def listen(self, trigger: Trigger) -> tuple[np.ndarray, tuple[str, ...]]:
        assert not self.closed
        fault = self.faults[self.takes] if self.takes < len(self.faults) else Fault()
        self.takes += 1
        out = np.zeros(trigger.before + trigger.longest)
        count = 0 if fault.silent else len(self.room[: len(out)])
        out[:count] = self.room[:count]
        out += self.noise * np.random.default_rng(self.takes).standard_normal(out.shape)
        samples = (fault.gain * out).astype(np.float32)
        start = trigger.start(samples, len(samples))
        if start is None:
            return samples[:0], ()
        if fault.nan:
            samples[start + trigger.before] = np.nan
        return samples[start : start + trigger.frames], fault.flags

    def describe(self) -> Mapping[str, Any]:
        return {"api": "fake"}

    def close(self) -> None:
        self.closed = True


def fake_card(line: FakeLine | None = None, **settings: Any) -> SoundCard:
    """A card on a fake line."""
    return SoundCard(line or FakeLine(), CardSettings(**{"device": "fake", **settings}))
